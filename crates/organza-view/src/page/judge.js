"use strict";
// What a picture is worth: its position between fast and exact, how it differs from one that was kept, and the values below the pointer.

/// Sends a request without a body, and shows the state that it answers with.
async function ask(path) {
  try {
    const answer = await fetch(`${path}?client=${client}`, { method: "POST" });
    const found = await answer.json();
    trouble(answer.ok ? "" : sentence(found));
    if (answer.ok) show(found);
    return answer.ok;
  } catch {
    lost();
    return false;
  }
}

// ---- accuracy ----

const POSITIONS = { "-3": "fastest", "-2": "fast", "-1": "a little faster", 0: "as in the scene", 1: "a little more exact", 2: "more exact", 3: "most exact" };
const errorText = (error) => (error === null ? "–" : error === 0 ? "0" : error.toPrecision(2));

/// The position that the slider is at, while a hand holds it.
let held = null;

function showAccuracy(found) {
  const accuracy = found.accuracy;
  if (!accuracy) return;
  const slider = at("accuracy");
  const rungs = accuracy.rungs;
  slider.disabled = rungs.length < 2 || !isOpen;
  at("rungs").hidden = rungs.length === 0;
  at("accuracy-reset").hidden = accuracy.step === 0 && accuracy.set.length === 0;
  if (rungs.length === 0) {
    at("accuracy-text").textContent = accuracy.set.length > 0
      ? `Drawn with ${accuracy.set.join(", ")}. Positions are known once the scene was drawn as it is.`
      : accuracy.is_predicting
        ? "Looking for positions, and what each would take …"
        : found.is_whole
          ? "There are no positions: splats of this picture serve no other."
          : "Comes with the whole picture.";
    return;
  }
  slider.max = rungs.length - 1;
  const chosen = Math.max(0, rungs.findIndex((rung) => rung.step === accuracy.step));
  if (held === null) slider.value = chosen;
  const rung = rungs[held === null ? chosen : held];
  const isOther = rung.step === accuracy.step && rung.set.join() !== accuracy.set.join();
  const set = isOther ? accuracy.set : rung.set;
  at("accuracy-text").textContent = textOfRung(rung, isOther) + (accuracy.is_predicting ? " Times are being predicted …" : "");
  slider.setAttribute("aria-valuetext", POSITIONS[rung.step]);
  at("lines").textContent = isOther ? set.join("\n") : rung.lines.trim() || "# as it is";
  const cells = (row) => [
    element("th", { scope: "row", textContent: POSITIONS[row.step] + (row.is_reference ? " ★" : "") }),
    ...[milliseconds(row.predicted_ms), milliseconds(row.measured_ms), errorText(row.rmse), errorText(row.flip)].map((textContent) => element("td", { textContent })),
  ];
  at("rungs").tBodies[0].replaceChildren(...rungs.map((row) => element("tr", { className: row === rung ? "chosen" : "" }, cells(row))));
}

function textOfRung(rung, isOther) {
  const name = POSITIONS[rung.step];
  const words = [name.charAt(0).toUpperCase() + name.slice(1)];
  if (isOther) return `${words[0]}, by settings of its own: nothing is known of these here.`;
  words.push(rung.predicted_ms === null ? "not predicted" : `predicted ${milliseconds(rung.predicted_ms)} ms`);
  words.push(rung.measured_ms === null ? "not measured yet" : `measured ${milliseconds(rung.measured_ms)} ms`);
  const error = rung.is_reference ? "; the most exact picture seen" : rung.rmse === null ? "" : `; RMSE ${errorText(rung.rmse)}, FLIP ${errorText(rung.flip)}`;
  return `${words[0]}: ${words.slice(1).join(", ")}${error}.`;
}

at("accuracy-panel").addEventListener("toggle", () => {
  if (at("accuracy-panel").open && !(shown && shown.accuracy)) ask("accuracy");
});
at("accuracy").addEventListener("input", () => {
  held = Number(at("accuracy").value);
  if (shown) showAccuracy(shown);
});
at("accuracy").addEventListener("change", () => {
  const rung = shown && shown.accuracy && shown.accuracy.rungs[Number(at("accuracy").value)];
  held = null;
  if (rung) add({ do: "accuracy", step: rung.step, set: rung.set });
});

at("accuracy-reset").addEventListener("click", () => add({ do: "accuracy", step: 0, set: [] }));

// ---- compare ----

const keptCanvas = at("kept");
let kept = null;
/// The kept picture and the state that were compared last, and those that the difference on the page belongs to.
let compared = "";
let differing = "";
let comparing = false;

async function keep() {
  at("compare-panel").open = true;
  await ask("keep");
}

function showCompare(found) {
  keepUp(found);
  arrange();
}

/// Follows the kept picture, and compares it with a new one.
function keepUp(found) {
  at("keep").disabled = !found.is_whole;
  at("let-go").hidden = at("compare").hidden = !found.kept;
  const number = found.kept ? found.kept.number : null;
  if (number !== kept) {
    kept = number;
    compared = "";
    at("difference").checked = false;
    keptCanvas.hidden = at("divider").hidden = kept === null;
    if (kept !== null) showOver("kept");
  }
  if (!found.kept) return;
  const key = pairOf(found.generation);
  if (key !== compared) at("compare-text").textContent = `${keptText(found.kept)}. Compared once the present picture is whole.`;
  if (found.is_whole && key !== compared && !comparing) compare(found.kept, key);
  placeDivider();
}

/// The kept picture and a state, in a word.
const pairOf = (state) => `${kept}/${state}`;

function keptText(row) {
  const position = row.step === 0 ? "" : `, ${POSITIONS[row.step]}`;
  return `Kept: ${row.technique}${position}, ${milliseconds(row.ms)} ms`;
}

async function compare(row, key) {
  comparing = true;
  const name = keptText(row);
  try {
    const answer = await fetch(`comparison?client=${client}`);
    if (answer.status === 200) {
      const found = await answer.json();
      compared = key;
      const isCompared = found.rmse !== null;
      at("compare-text").textContent = isCompared
        ? `${name}. Now and kept differ by RMSE ${errorText(found.rmse)}, FLIP ${errorText(found.flip)}.`
        : `${name}, ${row.size.width} × ${row.size.height}: pictures of two sizes, or of more than 4 million pixels, are not compared.`;
      at("difference").disabled = !isCompared;
      at("gain").textContent = isCompared ? `shown ${found.gain} times as large` : "";
      if (!isCompared) at("difference").checked = false;
      if (at("difference").checked || keptCanvas.dataset.what === "difference") await showOver(at("difference").checked ? "difference" : "kept");
    }
  } catch {
    lost();
  }
  comparing = false;
  // The scene may have changed meanwhile.
  if (shown && shown.kept && shown.is_whole && pairOf(shown.generation) !== key) showCompare(shown);
}

/// Shows the kept picture, or the difference, over the present one.
async function showOver(what) {
  try {
    const answer = await fetch(`${what}?client=${client}&of=${compared || kept}`);
    if (answer.status !== 200) return;
    const image = await createImageBitmap(await answer.blob());
    keptCanvas.width = image.width;
    keptCanvas.height = image.height;
    keptCanvas.getContext("2d").drawImage(image, 0, 0);
    keptCanvas.dataset.what = what;
    differing = answer.headers.get("organza-pair");
    image.close();
    placeDivider();
  } catch {
    lost();
  }
}

/// The divider, a share of the width of the picture: the kept picture is on its right.
function placeDivider() {
  if (kept === null) return;
  const isDifference = keptCanvas.dataset.what === "difference";
  // The picture may have changed since.
  const isOfPair = !isDifference || (differing === pairOf(generation) && at("coarse").hidden);
  keptCanvas.hidden = !isOfPair;
  at("difference-text").hidden = isOfPair;
  const { left, width } = pictureBox();
  const place = left + width * (1 - Number(at("divide").value) / 100);
  const isDivided = !isDifference && !isBeside();
  at("divider").hidden = !isDivided;
  at("divide").disabled = !isDivided;
  at("divider").style.left = `${place}px`;
  keptCanvas.style.clipPath = isDivided ? `inset(0 0 0 ${place}px)` : "none";
  at("beside-kept").textContent = isDifference ? "difference" : "kept";
}

/// Whether the present picture has the left half of the stage, and the kept one or the difference the right half.
const isBeside = () => kept !== null && at("beside").checked;

/// Places what lies on the stage anew where the picture has moved on it.
function arrange() {
  if (stage.classList.toggle("beside", isBeside()) === wasBeside) return;
  wasBeside = isBeside();
  if (shown) show(shown, true);
  if (cursor) placeCursor();
}
let wasBeside = false;

at("keep").addEventListener("click", keep);
at("let-go").addEventListener("click", () => ask("let-go"));
at("divide").addEventListener("input", placeDivider);
at("difference").addEventListener("change", () => showOver(at("difference").checked ? "difference" : "kept"));
at("beside").addEventListener("change", () => {
  arrange();
  placeDivider();
});
window.addEventListener("resize", placeDivider);
at("divider").addEventListener("pointerdown", (event) => {
  at("divider").setPointerCapture(event.pointerId);
  event.stopPropagation();
});
at("divider").addEventListener("pointermove", (event) => {
  if (!(event.buttons & 1)) return;
  event.stopPropagation();
  const box = stage.getBoundingClientRect();
  const { left, width } = pictureBox();
  const share = (event.clientX - box.left - left) / width;
  at("divide").value = Math.round(100 * (1 - Math.min(1, Math.max(0, share))));
  placeDivider();
});
at("divider").addEventListener("dblclick", (event) => event.stopPropagation());

// ---- values below the pointer ----

/// Time between two looks, milliseconds.
const LOOK = 150;
let isLooking = false;
let isWaiting = null;
let lastLook = 0;
/// Where the cursor of the keyboard is, shares of the picture.
let cursor = null;

/// How often values that are not known yet are asked for again.
const PATIENT = 60;
let unknown = 0;

/// Looks below the pointer again, or below the cursor: the view has changed.
function lookAgain() {
  const place = cursor || (pointer && pictureBelow(pointer));
  unknown = 0;
  if (place) lookBelow(place, false);
  // What was read is of another picture, and nobody points at this one.
  else at("below-text").textContent = "Point at the picture to read its values";
}

/// Looks below a place of the picture; of several in a short time the last.
function lookBelow(place, isSaid) {
  isWaiting = { place, isSaid };
  if (isLooking) return;
  isLooking = true;
  setTimeout(async () => {
    while (isWaiting && isOpen) {
      const { place, isSaid } = isWaiting;
      isWaiting = null;
      lastLook = performance.now();
      await lookOnce(place, isSaid);
      await pause(LOOK);
    }
    isLooking = false;
  }, Math.max(0, LOOK - (performance.now() - lastLook)));
}

async function lookOnce(place, isSaid) {
  try {
    const answer = await fetch(`below?client=${client}&right=${place.right.toFixed(6)}&down=${place.down.toFixed(6)}`);
    const isKnown = answer.status === 200;
    const text = isKnown ? belowText(await answer.json()) : "Values of this view are not known yet";
    // They come with its coarse picture.
    if (isKnown) unknown = 0;
    else if (!isWaiting && (unknown += 1) < PATIENT) isWaiting = { place, isSaid };
    at("below-text").textContent = text;
    if (isSaid) at("below-said").textContent = text;
  } catch {
    lost();
  }
}

function belowText(below) {
  const words = [];
  if (below.object !== null) words.push(below.object);
  if (below.position) words.push(`at ${below.position.map((number) => rounded(number)).join(", ")}`, `depth ${short(below.depth)}`);
  else words.push("nothing that hides what lies behind it");
  // A length that a hand can tell apart in the picture, in units of the file.
  const inFile = (number) => rounded(number * below.file_place.scale) / below.file_place.scale;
  if (below.file_place) words.push(`in its file ${below.file_place.position.map((number) => Number(inFile(number).toPrecision(10))).join(", ")}`);
  for (const { name, value, meaning } of below.values) words.push(`${name} ${short(value)}${meaning ? ` ${meaning}` : ""}`);
  if (below.numbers.length > 0) {
    // An infinite number comes as none.
    const number = (value) => (value === null ? "none" : Math.abs(value) < 1e-3 && value !== 0 ? value.toExponential(1) : String(Number(value.toPrecision(3))));
    words.push(`${below.layer} ${below.numbers.map(number).join(" ")}`);
  }
  return words.join(" · ");
}

stage.addEventListener("pointermove", (event) => {
  if (pointers.size > 0 || event.pointerType === "touch") return;
  const place = pictureBelow({ x: event.clientX, y: event.clientY });
  if (place) lookBelow(place, false);
});

// A touch has no pointer that hovers.
stage.addEventListener("click", (event) => {
  const place = pictureBelow({ x: event.clientX, y: event.clientY });
  if (place) lookBelow(place, false);
});

function toggleCursor() {
  cursor = cursor ? null : { right: 0.5, down: 0.5 };
  at("crosshair").hidden = !cursor;
  if (cursor) {
    stage.focus();
    placeCursor();
  } else {
    at("below-said").textContent = "The cursor is off";
  }
}

function placeCursor() {
  const box = pictureBox();
  at("crosshair").style.left = `${box.left + cursor.right * box.width}px`;
  at("crosshair").style.top = `${box.top + cursor.down * box.height}px`;
  lookBelow(cursor, true);
}

/// Moves the cursor by a key; whether the key was for it.
function moveCursor(event) {
  if (event.key === "Escape") {
    toggleCursor();
    return true;
  }
  const arrow = arrows[event.key];
  if (!arrow) return false;
  const step = event.shiftKey ? 0.1 : 0.01;
  const within = (share) => Math.min(1, Math.max(0, share));
  const aspect = shown ? shown.size.height / shown.size.width : 1;
  cursor = { right: within(cursor.right + arrow[0] * step * aspect), down: within(cursor.down - arrow[1] * step) };
  placeCursor();
  event.preventDefault();
  return true;
}
