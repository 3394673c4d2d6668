"use strict";
// Planes that cut objects open: rows in the panel, and in the picture the outline of the chosen plane, with a handle that is dragged along its normal.

const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const along = (place, direction, length) => place.map((number, k) => number + length * direction[k]);
const unit = (vector) => vector.map((number) => number / Math.hypot(...vector));
/// A number to a step that a hand can tell apart in a box, without the sign of nothing.
function rounded(number, box = shown.bounds) {
  // Before anything was drawn nobody knows how large it is.
  if (!box) return number;
  const { low, high } = box;
  const step = 10 ** Math.floor(Math.log10(Math.hypot(...along(high, low, -1)) / 2000));
  if (!(step > 0)) return number;
  return Number((Math.round(number / step) * step).toPrecision(12)) + 0;
}

/// As many as the server takes.
const MOST_CUTS = 32;

/// As far as the server takes them, world units.
const FARTHEST = 1e18;

/// How much farther than what it cuts a plane goes: splats reach beyond their middles.
const MARGIN = 0.02;

let cuts = [];
let chosenCut = 0;
let cutRows = [];

function setCuts(changed) {
  cuts = changed;
  add({ do: "cuts", cuts });
  fillCuts();
}

/// A box around what a cut of this object goes through, with a margin: around the object, or everything.
function boxOf(name) {
  const object = shown.objects.find((found) => found.name === name);
  const { low, high } = (object && object.bounds) || shown.bounds;
  const margin = MARGIN * Math.hypot(...along(high, low, -1));
  return { low: low.map((number) => number - margin), high: high.map((number) => number + margin) };
}

/// The middle of a box, and how far it reaches along a direction.
function reach({ low, high }, normal) {
  const middle = low.map((number, k) => (number + high[k]) / 2);
  const half = dot(normal.map(Math.abs), low.map((number, k) => (high[k] - number) / 2));
  return { middle, from: dot(middle, normal) - half, to: dot(middle, normal) + half };
}

const positionOf = (cut) => dot(unit(cut.normal), cut.point);

/// The same cut at another position along its normal.
function moved(cut, position) {
  const normal = unit(cut.normal);
  const box = boxOf(cut.object);
  const { middle } = reach(box, normal);
  const point = along(middle, normal, position - dot(middle, normal));
  return { ...cut, point: point.map((number) => rounded(number, box)) };
}

/// The same cut, or the nearest that touches what it cuts.
function within(cut) {
  if (!shown.bounds) return cut;
  const { from, to } = reach(boxOf(cut.object), unit(cut.normal));
  const position = Math.min(to, Math.max(from, positionOf(cut)));
  return position === positionOf(cut) ? cut : moved(cut, position);
}

/// The same cut where it goes through what it cuts, else through the middle of that: beside an object it takes all or nothing.
function through(cut) {
  if (!shown.bounds) return cut;
  const normal = unit(cut.normal);
  const { middle, from, to } = reach(boxOf(cut.object), normal);
  return positionOf(cut) > from && positionOf(cut) < to ? cut : moved(cut, dot(middle, normal));
}

const towardsEye = () => cross(shown.viewpoint.right, shown.viewpoint.up);

/// A cut through what the view turns around, across the axis that leads to the eye most, of those that no other cut is across.
function newCut() {
  const eye = towardsEye();
  const isTaken = (k) => cuts.some((cut) => axisOf(cut.normal) === "xyz"[k]);
  const free = [0, 1, 2].filter((k) => !isTaken(k));
  const axis = (free.length > 0 ? free : [0, 1, 2]).reduce((best, k) => (Math.abs(eye[k]) > Math.abs(eye[best]) ? k : best));
  const normal = [0, 0, 0];
  normal[axis] = Math.sign(eye[axis]) || 1;
  return { object: null, normal, point: middleOfView(null) };
}

/// The place that the view turns around, within what a cut of this object goes through.
function middleOfView(object) {
  const box = boxOf(object);
  return shown.viewpoint.centre.map((number, k) => rounded(Math.min(box.high[k], Math.max(box.low[k], number)), box));
}

/// The word for a direction; nothing where it is no axis.
function axisOf(normal) {
  const isAlong = (axis) => normal.every((number, k) => (axis[k] === 0) === (number === 0));
  return Object.keys(AXES).find((word) => isAlong(AXES[word])) || "";
}

function changeCut(index, change) {
  chosenCut = index;
  setCuts(cuts.map((cut, k) => (k === index ? change(cut) : cut)));
}

function makeCut(index) {
  const label = (text) => `${text} of cut ${index + 1}`;
  const option = (value, textContent) => element("option", { value, textContent });
  const row = {};
  row.object = element("select", { "aria-label": label("Object") }, [option("", "everything"), ...shown.objects.map((object) => option(object.name, object.name))]);
  row.object.addEventListener("change", () => changeCut(index, (cut) => through({ ...cut, object: row.object.value || null })));
  row.axis = element("select", { "aria-label": label("Direction") }, [
    ...Object.keys(AXES).map((word) => option(word, `along ${word}`)), option("view", "as seen"), element("option", { value: "", textContent: "slanted", hidden: true }),
  ]);
  row.axis.addEventListener("change", () => {
    const normal = AXES[row.axis.value] || towardsEye().map((number) => Number(number.toFixed(4)) + 0);
    const away = dot(normal, towardsEye()) < 0 ? -1 : 1;
    changeCut(index, (cut) => ({ ...cut, normal: normal.map((number) => away * number + 0), point: middleOfView(cut.object) }));
  });
  const button = (text, title, act) => {
    const made = element("button", { type: "button", textContent: text, title, "aria-label": label(title) });
    made.addEventListener("click", act);
    return made;
  };
  const flip = button("Flip", "Take the other side away", () => changeCut(index, (cut) => ({ ...cut, normal: cut.normal.map((number) => 0 - number) })));
  const remove = button("×", "Remove", () => {
    chosenCut = Math.max(0, index - 1);
    setCuts(cuts.filter((_, k) => k !== index));
    at("add-cut").focus();
  });
  row.slider = element("input", { type: "range", "aria-label": label("Position") });
  row.slider.addEventListener("input", () => changeCut(index, (cut) => moved(cut, signOf(cut) * Number(row.slider.value))));
  row.number = element("input", { type: "number", step: "any", "aria-label": label("Position, world units,") });
  row.number.addEventListener("change", () => {
    const number = numberIn(row.number, -FARTHEST, FARTHEST);
    if (number === null) return;
    changeCut(index, (cut) => moved(cut, signOf(cut) * number));
    row.number.blur();
    fillCuts();
  });
  row.item = element("li", { className: "cut" }, [row.object, row.axis, flip, remove, row.slider, row.number]);
  row.item.addEventListener("focusin", () => {
    chosenCut = index;
    placePlane();
  });
  return row;
}

/// A position is that on the axis, whichever side is kept.
const signOf = (cut) => (axisOf(cut.normal) && cut.normal.some((number) => number < 0) ? -1 : 1);

function fillCuts() {
  if (cutRows.length !== cuts.length) {
    cutRows = cuts.map((_, index) => makeCut(index));
    at("cuts").replaceChildren(...cutRows.map((row) => row.item));
  }
  chosenCut = Math.min(chosenCut, Math.max(0, cuts.length - 1));
  cuts.forEach((cut, index) => {
    const row = cutRows[index];
    row.number.disabled = row.slider.disabled = row.axis.disabled = !shown.bounds;
    const normal = unit(cut.normal).map((number) => signOf(cut) * number);
    row.object.value = cut.object || "";
    if (!isHeld(row.axis)) row.axis.value = axisOf(cut.normal);
    if (shown.bounds) {
      const { from, to } = reach(boxOf(cut.object), normal);
      Object.assign(row.slider, { min: from, max: to, step: (to - from) / 400 || "any" });
    }
    const position = dot(normal, cut.point);
    if (!isHeld(row.slider)) row.slider.value = position;
    if (!isHeld(row.number)) row.number.value = shown.bounds ? rounded(position, boxOf(cut.object)) : position;
  });
  at("add-cut").disabled = !shown.bounds || cuts.length >= MOST_CUTS;
  placePlane();
}

function showCuts(found) {
  // What is on its way is newer.
  if (!waiting.some((event) => event.do === "cuts")) cuts = found.cuts;
  fillCuts();
}

// ---- the chosen plane in the picture ----

/// Where a place of the world is on the stage, CSS pixels; nothing behind the eye.
function onStage(place) {
  const eye = shown.viewpoint;
  const from = place.map((number, k) => number - eye.centre[k]);
  const depth = eye.distance - dot(from, towardsEye());
  if (!eye.is_parallel && depth <= 1e-3 * eye.distance) return null;
  const box = pictureBox();
  const scale = ((eye.is_parallel ? 1 : eye.distance / depth) * box.height) / eye.height;
  return [box.left + box.width / 2 + scale * dot(from, eye.right), box.top + box.height / 2 - scale * dot(from, eye.up)];
}

/// The corners of a plane in the box of what it cuts, around its middle.
function outline(cut) {
  const { low, high } = boxOf(cut.object);
  const normal = unit(cut.normal);
  const { from, to } = reach({ low, high }, normal);
  // At its ends a plane only touches what there is.
  const inset = 1e-6 * (to - from);
  const position = Math.min(to - inset, Math.max(from + inset, dot(normal, cut.point)));
  const corner = (bits) => low.map((number, k) => ((bits >> k) & 1 ? high[k] : number));
  const found = [];
  for (let bits = 0; bits < 8; bits += 1) {
    for (const k of [0, 1, 2].filter((k) => !((bits >> k) & 1))) {
      const [a, b] = [corner(bits), corner(bits | (1 << k))];
      const [before, behind] = [dot(normal, a) - position, dot(normal, b) - position];
      if (before !== behind && before * behind <= 0) found.push(along(a, along(b, a, -1), before / (before - behind)));
    }
  }
  if (found.length < 3) return found;
  const middle = found.reduce((sum, place) => along(sum, place, 1 / found.length), [0, 0, 0]);
  const side = unit(along(found[0], middle, -1));
  const other = cross(normal, side);
  const angle = (place) => Math.atan2(dot(along(place, middle, -1), other), dot(along(place, middle, -1), side));
  return found.sort((a, b) => angle(a) - angle(b));
}

/// Where the handle is, and where it goes for each world unit along the normal; nothing where the plane is not on the stage.
function handleOf(cut) {
  const places = outline(cut);
  if (places.length < 3) return null;
  const middle = places.reduce((sum, place) => along(sum, place, 1 / places.length), [0, 0, 0]);
  const { low, high } = boxOf(cut.object);
  const step = Math.hypot(...along(high, low, -1)) / 100;
  const [here, there] = [onStage(middle), onStage(along(middle, unit(cut.normal), step))];
  if (!here || !there) return null;
  return { here, way: [(there[0] - here[0]) / step, (there[1] - here[1]) / step], places };
}

function placePlane() {
  const cut = cuts[chosenCut];
  const handle = cut && shown.bounds && at("cuts-panel").open ? handleOf(cut) : null;
  at("plane").toggleAttribute("hidden", !handle);
  cutRows.forEach((row, index) => row.item.classList.toggle("chosen", index === chosenCut && cuts.length > 1));
  if (!handle) return;
  const corners = handle.places.map(onStage);
  at("plane-outline").setAttribute("points", corners.every(Boolean) ? corners.map((corner) => corner.join()).join(" ") : "");
  const length = Math.hypot(...handle.way) || 1;
  const end = handle.here.map((number, k) => number + (34 * handle.way[k]) / length);
  for (const [key, number] of [["x1", handle.here[0]], ["y1", handle.here[1]], ["x2", end[0]], ["y2", end[1]]]) at("plane-normal").setAttribute(key, number);
  at("plane-handle").setAttribute("cx", handle.here[0]);
  at("plane-handle").setAttribute("cy", handle.here[1]);
}

let heldCut = null;
at("plane-handle").addEventListener("pointerdown", (event) => {
  const cut = cuts[chosenCut];
  const handle = cut && handleOf(cut);
  if (!handle) return;
  event.stopPropagation();
  event.target.setPointerCapture(event.pointerId);
  heldCut = { x: event.clientX, y: event.clientY, way: handle.way, position: positionOf(cut) };
});
at("plane-handle").addEventListener("pointermove", (event) => {
  if (!heldCut) return;
  event.stopPropagation();
  const drag = [event.clientX - heldCut.x, event.clientY - heldCut.y];
  const { way } = heldCut;
  const pixels = pictureHeight() / shown.viewpoint.height;
  // A normal that leads to the eye has no way in the picture: downwards is towards the eye then.
  const isSeen = Math.hypot(...way) > 0.15 * pixels;
  const towards = dot(unit(cuts[chosenCut].normal), towardsEye()) < 0 ? -1 : 1;
  const distance = isSeen ? (drag[0] * way[0] + drag[1] * way[1]) / (way[0] ** 2 + way[1] ** 2) : (towards * drag[1]) / pixels;
  changeCut(chosenCut, (cut) => within(moved(cut, heldCut.position + distance)));
});
for (const end of ["pointerup", "pointercancel"]) {
  at("plane-handle").addEventListener(end, (event) => {
    event.stopPropagation();
    heldCut = null;
  });
}

at("add-cut").addEventListener("click", () => {
  chosenCut = cuts.length;
  setCuts([...cuts, newCut()]);
  cutRows[chosenCut].slider.focus();
});
at("cuts-panel").addEventListener("toggle", placePlane);
new ResizeObserver(() => shown && placePlane()).observe(stage);
