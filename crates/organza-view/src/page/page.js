"use strict";
// Everything comes from this server: the state and the pictures by two requests that wait for news, and events go back one after the other.

const client = Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
const at = (id) => document.getElementById(id);
const stage = at("stage");
const canvas = at("picture");
const pen = canvas.getContext("2d");

let shown = null;
let rank = 0;
let isOpen = true;

// ---- events to the server: those of a drag are added up while the one before is on its way ----

let waiting = [];
let isSending = false;
/// Whether there was an event since the hand last let go.
let isChanging = false;
/// What the page says once they are taken.
let afterwards = "";

function add(event) {
  isChanging = event.do !== "done";
  const last = waiting[waiting.length - 1];
  const adds = { orbit: ["right", "up"], pan: ["right", "up"], zoom: ["steps"] }[event.do];
  const replaces = {
    exposure: [], size: [], cuts: [], opacity: ["object"], color: ["object"], transfer: ["object"], light_intensity: ["light"], light_direction: ["light"],
  }[event.do];
  if (last && adds && last.do === event.do) {
    for (const key of adds) last[key] += event[key];
  } else if (last && replaces && last.do === event.do && replaces.every((key) => last[key] === event[key])) {
    waiting[waiting.length - 1] = event;
  } else {
    waiting.push(event);
  }
  send();
}

/// A step ends when the hand lets go, and the whole picture begins: behind the listeners of what it held.
for (const name of ["pointerup", "click", "change", "keyup"]) {
  document.addEventListener(name, () => setTimeout(() => isChanging && add({ do: "done" })));
}

async function send() {
  if (isSending || waiting.length === 0) return;
  isSending = true;
  const events = waiting;
  const said = afterwards;
  waiting = [];
  afterwards = "";
  try {
    const answer = await fetch(`events?client=${client}`, {
      method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(events),
    });
    const found = await answer.json();
    if (answer.ok) {
      trouble(said);
      show(found);
      // A size that came back by itself is for its fields, too.
      if (said) showAgain();
    } else {
      trouble(sentence(found));
      showAgain();
    }
  } catch {
    lost();
  }
  isSending = false;
  send();
}

// ---- news from the server ----

function pause(ms) {
  return new Promise((resolve) => setTimeout(resolve, ms));
}

async function follow(path, after, take) {
  let failures = 0;
  while (isOpen) {
    try {
      const answer = await fetch(`${path}?client=${client}&after=${after()}`);
      if ([403, 409, 410].includes(answer.status)) {
        trouble(sentence(await answer.json()));
        at("waiting").textContent = "";
        isOpen = false;
        return;
      }
      if (answer.ok) await take(answer);
      failures = 0;
    } catch {
      failures += 1;
      if (failures > 2) {
        lost();
        return;
      }
      await pause(300 * failures);
    }
  }
}

function lost() {
  if (!isOpen) return;
  isOpen = false;
  trouble("The view has ended. Start `organza view` again and open its new address.");
  for (const control of document.querySelectorAll("#panels input, #panels button")) control.disabled = true;
}

function sentence(error) {
  // A message may begin with the name of a file, which keeps its letters.
  if (!error.hint) return error.message;
  const hint = error.hint.charAt(0).toUpperCase() + error.hint.slice(1);
  return `${error.message}. ${hint}${/[.?!]$/.test(hint) ? "" : "."}`;
}

let isOfPicture = false;
function trouble(text, isFailure = false) {
  isOfPicture = isFailure;
  at("trouble").textContent = text;
  at("trouble").hidden = text === "";
}

// The picture that is on the page: the state may know of a newer one already.
let number = 0;
let generation = 0;
async function takePicture(answer) {
  if (answer.status !== 200) return;
  const image = await createImageBitmap(await answer.blob());
  canvas.width = image.width;
  canvas.height = image.height;
  pen.drawImage(image, 0, 0);
  image.close();
  number = Number(answer.headers.get("organza-number"));
  generation = Number(answer.headers.get("organza-generation"));
  at("waiting").hidden = true;
  if (shown) showMark(shown);
  placeDivider();
  lookAgain();
}

/// Says of a picture that is not the whole one of the present state what it is.
function showMark(found) {
  const isCoarse = canvas.width < found.size.width || canvas.height < found.size.height;
  at("coarse").hidden = number === 0 || (!isCoarse && generation === found.generation);
  at("coarse").textContent = isCoarse ? "coarse" : "before the last change";
}

// ---- what the page shows ----

function show(found, isAgain = false) {
  if (shown && found.session !== shown.session) {
    // Another scene is open: nothing of this one holds.
    isOpen = false;
    location.replace(location.pathname);
    return;
  }
  if (shown && found.version < shown.version && !isAgain) return;
  shown = found;
  document.title = `${found.title} · Organza`;
  at("title").textContent = found.title;
  at("title").title = found.title;
  showStatus(found);
  showObjects(found.objects);
  showCuts(found);
  showLights(found.lights);
  showEffects(found.effects);
  showAccuracy(found);
  showCompare(found);
  showOverlay(found);
  checkSize(found);
  if (!isHeld(at("technique"))) at("technique").value = found.technique || "";
  if (found.picture && found.picture.level === "whole") showPasses(found.picture.passes);
  if (found.picture) showLegends(found.picture.legends);
  if (!isHeld(at("layer"))) at("layer").value = found.layer || "";
  if (!isHeld(at("exposure"))) at("exposure").value = found.exposure;
  at("exposure-value").textContent = `${found.exposure > 0 ? "+" : ""}${found.exposure} EV`;
  for (const side of ["width", "height"]) {
    if (!isHeld(at(side))) at(side).value = found.size[side];
  }
  at("undo").disabled = !found.can_undo;
  at("redo").disabled = !found.can_redo;
  at("restore").disabled = !found.can_undo;
  at("open").hidden = found.most_file_bytes === null;
  showOpening(found);
  stage.style.setProperty("--aspect", `${found.size.width} / ${found.size.height}`);
  for (const id of ["save-png", "save-exr"]) at(id).disabled = !found.is_whole;
}

function showStatus(found) {
  const picture = found.picture;
  const drawing = found.drawing;
  const words = [];
  if (picture) {
    const ms = picture.ms < 10 ? picture.ms.toFixed(1) : Math.round(picture.ms);
    const share = picture.splat_share < 1 ? `, 1/${Math.round(1 / picture.splat_share)} of the splats` : "";
    words.push(picture.level === "whole" ? "whole" : `coarse, ${picture.size.width} × ${picture.size.height} pixels${share}`, `${ms} ms`);
    if (picture.level === "whole") words.push(`${picture.size.width} × ${picture.size.height}`);
    words.push(picture.technique);
    if (picture.sets) words.push(`${picture.sets} sets`);
  }
  if (drawing) words.push(drawing.stage ? `drawing: ${drawing.stage}` : "drawing");
  at("facts").textContent = words.join(" · ");
  at("facts").title = words.join(" · ");
  at("share").hidden = !drawing;
  at("share").value = drawing ? drawing.share : 0;
  showMark(found);
  if (!picture) at("waiting").textContent = drawing && drawing.stage ? `Drawing: ${drawing.stage}` : "Reading the scene";
  const eye = found.viewpoint;
  at("where").textContent = `azimuth ${eye.azimuth.toFixed(0)}°, elevation ${eye.elevation.toFixed(0)}°`;
  canvas.setAttribute("aria-label", `${found.title} from azimuth ${eye.azimuth.toFixed(0)}, elevation ${eye.elevation.toFixed(0)} degrees`);
  if (found.failure) {
    trouble(sentence(found.failure), true);
    if (!picture) at("waiting").textContent = "";
  } else if (isOfPicture) {
    trouble("");
  }
  showWarnings(picture && picture.level === "whole" ? picture.warnings : null);
}

let warned = null;
function showWarnings(warnings) {
  // A coarse picture has warnings of its own size: those of the last whole one stay.
  if (!warnings || JSON.stringify(warnings) === warned) return;
  warned = JSON.stringify(warnings);
  const box = at("warnings");
  box.hidden = warnings.length === 0;
  box.querySelector("summary").textContent =
    warnings.length === 1 ? `Warning: ${warnings[0]}` : `${warnings.length} warnings: ${warnings[0] || ""}`;
  box.querySelector("ul").replaceChildren(...warnings.map((warning) => element("li", { textContent: warning })));
}

/// What a hand holds is newer than what comes back, unless it was refused.
let isRefused = false;
const isHeld = (input) => document.activeElement === input && !isRefused;

/// Something was refused: fields show again what holds.
function showAgain() {
  if (!shown) return;
  isRefused = true;
  show(shown, true);
  isRefused = false;
}

/// The number in a field. Where it is none from `least` to `most`, the page says so, the field shows the last good number again, and there is nothing.
function numberIn(input, least, most) {
  const number = Number(input.value);
  if (input.value !== "" && number >= least && number <= most) return number;
  const label = input.getAttribute("aria-label") || input.labels[0].textContent;
  trouble(`${label}: expected a number from ${least} to ${most}, found ${input.value || "no number"}. The last good number is back.`);
  showAgain();
  return null;
}

function element(name, values = {}, children = []) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(values)) {
    if (key.includes("-") || key === "role") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children);
  return made;
}

/// Rows are made once for each name, and filled anew: what has the focus keeps it, and nothing moves below the pointer. Of a list in groups a row that is
/// gone stays where it was, and a new one comes behind the others of its group.
const rows = { objects: new Map(), lights: new Map(), effects: new Map() };
function rowsOf(list, items, make, fill, group) {
  const known = rows[list];
  const names = items.map((item) => item.name);
  if (!group && names.join("\n") !== [...known.keys()].join("\n")) {
    known.clear();
    at(list).replaceChildren();
  }
  for (const item of items) {
    if (known.has(item.name)) continue;
    const row = make(item);
    row.group = group ? group(item) : 0;
    known.set(item.name, row);
    const behind = [...at(list).children].find((child) => Number(child.dataset.group) > row.group);
    row.item.dataset.group = row.group;
    at(list).insertBefore(row.item, behind || null);
  }
  for (const [name, row] of known) row.item.classList.toggle("gone", !names.includes(name));
  for (const item of items) fill(known.get(item.name), item);
}

function showObjects(objects) {
  rowsOf("objects", objects, makeObject, (row, object) => {
    row.visible.checked = object.visible;
    if (row.opacity) {
      if (!isHeld(row.opacity) || !isSending) row.opacity.value = object.opacity;
      row.value.textContent = object.opacity.toFixed(2);
      row.opacity.disabled = !object.visible;
    }
    if (row.color) {
      row.color.classList.toggle("unset", object.color === null);
      if (!isHeld(row.color)) row.color.value = hexOf(object.color || [0.6, 0.6, 0.6]);
      row.uncolored.hidden = !object.is_recolored;
    }
    showColumns(row, object);
    if (!isHeld(row.technique)) row.technique.value = object.technique || "";
    if (row.curve) row.curve.show(object.curve);
  });
}

/// Columns come with the file.
function showColumns(row, object) {
  row.by.hidden = object.columns.length === 0;
  if (row.columns !== object.columns.join("\n")) {
    row.columns = object.columns.join("\n");
    row.column.replaceChildren(element("option", { value: "", textContent: "as in the scene" }), ...object.columns.map((name) => element("option", { value: name, textContent: name })));
  }
  if (!isHeld(row.column)) row.column.value = object.color_by || "";
  if (!isHeld(row.map)) row.map.value = object.map || "";
  row.map.hidden = object.color_by === null;
}

function choice(label, options) {
  return element("select", { "aria-label": label }, options.map(([value, textContent]) => element("option", { value, textContent })));
}

function makeObject(object) {
  const id = `object-${(rank += 1)}`;
  const visible = element("input", { type: "checkbox", id });
  visible.addEventListener("change", () => add({ do: "show", object: object.name, visible: visible.checked }));
  const children = [
    visible,
    element("label", { className: "name", htmlFor: id, textContent: object.name }),
    element("span", { className: "kind", textContent: object.kind === object.name ? "" : object.kind }),
  ];
  const row = { visible };
  if (object.opacity !== null) {
    row.opacity = element("input", { type: "range", min: 0, max: 1, step: 0.01, "aria-label": `Opacity of ${object.name}` });
    row.value = element("output");
    row.opacity.addEventListener("input", () => {
      row.value.textContent = Number(row.opacity.value).toFixed(2);
      add({ do: "opacity", object: object.name, opacity: Number(row.opacity.value) });
    });
    children.push(element("span", { className: "opacity" }, [element("span", { textContent: "Opacity" }), row.opacity, row.value]));
  }
  if (object.takes_color) {
    row.color = element("input", { type: "color", "aria-label": `Colour of ${object.name}` });
    row.color.addEventListener("input", () => add({ do: "color", object: object.name, color: linearOf(row.color.value) }));
    row.uncolored = element("button", { type: "button", textContent: "as in the scene", "aria-label": `Colour of ${object.name} as in the scene` });
    row.uncolored.addEventListener("click", () => add({ do: "color", object: object.name, color: null }));
    children.push(element("span", { className: "color" }, [element("span", { textContent: "Colour" }), row.color, row.uncolored]));
  }
  row.column = choice(`Column that colours ${object.name}`, []);
  row.map = choice(`Map of the colours of ${object.name}`, [["", "automatic map"], ...shown.maps.map((map) => [map, map])]);
  const colorBy = () => add({ do: "color_by", object: object.name, column: row.column.value || null, map: row.map.value || null });
  row.column.addEventListener("change", colorBy);
  row.map.addEventListener("change", colorBy);
  row.by = element("span", { className: "color" }, [element("span", { textContent: "Colour by" }), row.column, row.map]);
  row.technique = choice(`Technique of ${object.name}`, [["", "as the picture"], ...["points", "particles", "sheets", "surfels", "reference"].map((name) => [name, name])]);
  row.technique.addEventListener("change", () => add({ do: "object_technique", object: object.name, technique: row.technique.value || null }));
  children.push(row.by, element("span", { className: "color" }, [element("span", { textContent: "Technique" }), row.technique]));
  if (object.curve) {
    row.curve = new Curve(object.name, (knots) => add({ do: "transfer", object: object.name, knots }));
    children.push(row.curve.panel);
  }
  row.item = element("li", { className: "object" }, children);
  return row;
}

function showLights(lights) {
  at("lights-panel").hidden = lights.length === 0;
  rowsOf("lights", lights, makeLight, (row, light) => {
    // An effect that is off overrules the light.
    row.effect = `shadow.${light.name}`;
    row.isOff = shown.effects.some((effect) => effect.name === row.effect && effect.switch === "off");
    row.castsShadow = light.shadow;
    row.shadow.checked = light.shadow && !row.isOff;
    if (!isHeld(row.stops)) row.stops.value = light.stops;
    row.value.textContent = `${light.stops > 0 ? "+" : ""}${Number(light.stops.toFixed(2))} EV`;
    if (!row.azimuth || !light.direction) return;
    for (const side of ["azimuth", "elevation"]) {
      if (!isHeld(row[side])) row[side].value = Math.round(light.direction[side]);
    }
    row.ball.show(light.direction);
  });
}

/// As the server takes them, degrees.
const MOST_AZIMUTH = 360;
const MOST_ELEVATION = 90;

function makeLight(light) {
  const row = {};
  const id = `light-${(rank += 1)}`;
  row.stops = element("input", { type: "range", min: -6, max: 6, step: 0.25, "aria-label": `Intensity of light ${light.name}, stops` });
  row.value = element("output");
  row.stops.addEventListener("input", () => add({ do: "light_intensity", light: light.name, stops: Number(row.stops.value) }));
  row.shadow = element("input", { type: "checkbox", id });
  row.shadow.addEventListener("change", () => {
    const shadow = row.shadow.checked;
    if (shadow && row.isOff) add({ do: "effect", name: row.effect, switch: "auto" });
    if (shadow !== row.castsShadow) add({ do: "light_shadow", light: light.name, shadow });
  });
  const children = [
    element("span", { className: "name", textContent: light.name }),
    element("span", { className: "kind", textContent: light.kind }),
    element("label", { className: "tick", htmlFor: id }, [row.shadow, element("span", { textContent: "shadow" })]),
    element("span", { className: "slider" }, [element("span", { textContent: "Intensity" }), row.stops, row.value]),
  ];
  if (light.direction) {
    const turn = () => {
      const azimuth = numberIn(row.azimuth, -MOST_AZIMUTH, MOST_AZIMUTH);
      const elevation = azimuth === null ? null : numberIn(row.elevation, -MOST_ELEVATION, MOST_ELEVATION);
      if (elevation !== null) add({ do: "light_direction", light: light.name, azimuth, elevation });
    };
    const number = (label, most) => {
      const input = element("input", { type: "number", min: -most, max: most, step: 1, "aria-label": `${label} of light ${light.name}, degrees` });
      input.addEventListener("change", turn);
      return input;
    };
    row.azimuth = number("Azimuth", MOST_AZIMUTH);
    row.elevation = number("Elevation", MOST_ELEVATION);
    row.ball = new Ball((direction) => {
      row.azimuth.value = Math.round(direction.azimuth);
      row.elevation.value = Math.round(direction.elevation);
      turn();
    });
    children.push(element("span", { className: "direction" }, [
      row.ball.canvas,
      element("label", {}, [element("span", { textContent: "Azimuth" }), row.azimuth, "°"]),
      element("label", {}, [element("span", { textContent: "Elevation" }), row.elevation, "°"]),
    ]));
  }
  row.item = element("li", { className: "light" }, children);
  return row;
}

/// From where a light comes: the half of a ball that is above, seen from above, or the one below. Dragged, it follows the pointer.
class Ball {
  constructor(take) {
    this.canvas = element("canvas", { width: 112, height: 112, className: "ball", title: "Drag: from where the light comes, seen from above" });
    this.canvas.setAttribute("aria-hidden", "true");
    this.direction = { azimuth: 0, elevation: 0 };
    const move = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const x = (2 * (event.clientX - box.left)) / box.width - 1;
      const z = (2 * (event.clientY - box.top)) / box.height - 1;
      const level = Math.min(1, Math.hypot(x, z) / 0.9);
      const sign = this.direction.elevation < 0 ? -1 : 1;
      this.show({ azimuth: (Math.atan2(x, z) * 180) / Math.PI, elevation: (sign * Math.acos(level) * 180) / Math.PI });
      take(this.direction);
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      move(event);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) move(event);
    });
  }

  show(direction) {
    this.direction = direction;
    const pen = this.canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    const side = this.canvas.width;
    const radius = 0.45 * side;
    pen.clearRect(0, 0, side, side);
    pen.strokeStyle = style.getPropertyValue("--line");
    pen.lineWidth = 2;
    for (const part of [1, 0.5]) {
      pen.beginPath();
      pen.arc(side / 2, side / 2, radius * part, 0, 2 * Math.PI);
      pen.stroke();
    }
    const [azimuth, elevation] = [direction.azimuth, direction.elevation].map((degrees) => (degrees * Math.PI) / 180);
    const level = radius * Math.cos(elevation);
    pen.beginPath();
    pen.arc(side / 2 + level * Math.sin(azimuth), side / 2 + level * Math.cos(azimuth), 7, 0, 2 * Math.PI);
    pen.fillStyle = pen.strokeStyle = style.getPropertyValue("--accent");
    if (elevation >= 0) pen.fill();
    pen.stroke();
  }
}

const milliseconds = (ms) => (ms === null ? "–" : ms < 10 ? ms.toFixed(1) : String(Math.round(ms)));

function showPasses(passes) {
  const cells = (pass) => [
    element("th", { scope: "row", textContent: pass.name }),
    element("td", { textContent: milliseconds(pass.predicted_ms) }),
    element("td", { textContent: milliseconds(pass.measured_ms) }),
  ];
  at("passes").tBodies[0].replaceChildren(...passes.map((pass) => element("tr", {}, cells(pass))));
}

let legends = "";
function showLegends(every) {
  // One colour alone stands for nothing.
  const found = every.filter((legend) => !legend.is_even || new Set(legend.marks.map((mark) => mark.color.join())).size > 1);
  const text = JSON.stringify(found);
  if (text === legends) return;
  legends = text;
  at("legends").hidden = found.length === 0;
  const css = (color) => `rgb(${color.join(" ")})`;
  at("legends").replaceChildren(...found.map((legend) => {
    const title = element("p", { textContent: legend.title });
    if (!legend.is_even) {
      const mark = (item) => {
        const square = element("span", { className: "square" });
        square.style.background = css(item.color);
        return element("li", {}, [square, item.meaning ? `${short(item.number)} ${item.meaning}` : short(item.number)]);
      };
      return element("div", { className: "legend" }, [title, element("ul", {}, legend.marks.map(mark))]);
    }
    const bar = element("span", { className: "bar" });
    bar.style.background = `linear-gradient(to right, ${legend.marks.map((mark) => css(mark.color)).join(", ")})`;
    const [first, last] = [legend.marks[0], legend.marks[legend.marks.length - 1]];
    const ends = element("p", { className: "ends" }, [element("span", { textContent: short(first.number) }), element("span", { textContent: short(last.number) })]);
    return element("div", { className: "legend" }, [title, bar, ends]);
  }));
}

function short(number) {
  return String(Number(number.toPrecision(4)));
}

/// What can be switched comes first; objects have their own panel.
function order(effect) {
  return effect.fixed ? 2 : effect.name.startsWith("object.") ? 1 : 0;
}

function showEffects(effects) {
  rowsOf("effects", effects, makeEffect, (row, effect) => {
    row.item.classList.toggle("left-out", !effect.called_for);
    row.bound.textContent = boundText(effect.bound);
    row.why.textContent = effect.reason;
    const isDrawn = effect.called_for && !effect.lacking;
    row.state.textContent = effect.fixed || (effect.lacking ? "called for, not drawn" : isDrawn ? "simulated" : "left out");
    if (effect.measured_ms !== null) row.spent = costText(effect);
    row.cost.textContent = effect.switch === "off" && row.spent ? `took ${row.spent}` : costText(effect);
    row.cost.title = effect.switch === "off" && row.spent ? "Time of its passes in the last whole picture with it" : costTitle(effect);
    for (const [word, input] of Object.entries(row.inputs)) input.checked = effect.switch === word;
  }, order);
}

function costText(effect) {
  if (effect.predicted_ms === null && effect.measured_ms === null) return "";
  const share = effect.sharing > 1 ? "even share: " : "";
  const measured = effect.measured_ms === null ? "kept" : `${share}${milliseconds(effect.measured_ms)} ms`;
  return effect.predicted_ms === null ? measured : `${measured} (${milliseconds(effect.predicted_ms)})`;
}

function costTitle(effect) {
  const text = "Measured time of its passes in the last whole picture, and the predicted one";
  return effect.sharing > 1 ? `${text}. The passes of ${effect.sharing} effects are measured together, and their time is shared evenly` : text;
}

function boundText(bound) {
  if (bound === null) return "bound unknown";
  if (bound === 0) return "nothing";
  const percent = 100 * bound;
  if (percent < 0.01) return "< 0.01 %";
  return `up to ${percent < 10 ? Number(percent.toPrecision(2)) : Math.round(percent)} %`;
}

function makeEffect(effect) {
  const row = { inputs: {} };
  row.bound = element("span", { className: "bound" });
  row.why = element("summary");
  row.state = element("span", { className: "state" });
  row.cost = element("span", { className: "cost" });
  const group = `effect-${(rank += 1)}`;
  const switches = effect.fixed ? [] : ["auto", "on", "off"].map((word) => {
    const input = element("input", { type: "radio", name: group, value: word });
    input.addEventListener("change", () => add({ do: "effect", name: effect.name, switch: word }));
    row.inputs[word] = input;
    return element("label", {}, [input, element("span", { textContent: word })]);
  });
  const name = element("span", { className: "name", textContent: effect.name, title: effect.what });
  const head = element("div", { className: "head" }, [name, row.bound]);
  const choice = element("div", { className: "choice" }, [row.state, row.cost]);
  if (switches.length > 0) {
    choice.prepend(element("span", { className: "switch", role: "radiogroup", "aria-label": `${effect.name}, ${effect.what}` }, switches));
  }
  row.item = element("li", { className: "effect" }, [head, element("details", { className: "why" }, [row.why]), choice]);
  return row;
}

// ---- the pointer ----

/// Where the present picture is on the stage, CSS pixels: as large as there is room, in the left half beside the kept one.
function pictureBox() {
  const aspect = shown ? shown.size.width / shown.size.height : 16 / 9;
  const room = isBeside() ? stage.clientWidth / 2 : stage.clientWidth;
  const height = Math.min(stage.clientHeight, room / aspect) || 1;
  const width = height * aspect;
  return { left: (room - width) / 2, top: (stage.clientHeight - height) / 2, width, height };
}

/// Shares of it are what events are in.
const pictureHeight = () => pictureBox().height;

const pointers = new Map();
let span = null;

stage.addEventListener("pointerdown", (event) => {
  stage.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button !== 0 || event.shiftKey });
  span = null;
  stage.classList.add("dragging");
});

stage.addEventListener("pointermove", (event) => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const right = (event.clientX - before.x) / pictureHeight();
  const up = (before.y - event.clientY) / pictureHeight();
  before.x = event.clientX;
  before.y = event.clientY;
  if (pointers.size === 2) {
    const [a, b] = [...pointers.values()];
    const now = Math.hypot(a.x - b.x, a.y - b.y);
    if (span && now > 0) add({ do: "zoom", steps: 6 * Math.log2(now / span) });
    span = now;
    add({ do: "pan", right: right / 2, up: up / 2 });
  } else if (right !== 0 || up !== 0) {
    add({ do: before.pans ? "pan" : "orbit", right, up });
  }
});

function release(event) {
  pointers.delete(event.pointerId);
  span = null;
  if (pointers.size === 0) stage.classList.remove("dragging");
}
stage.addEventListener("pointerup", release);
stage.addEventListener("pointercancel", release);
stage.addEventListener("contextmenu", (event) => event.preventDefault());

/// The place in the picture below the pointer, or its middle; nothing beside it.
let pointer = null;
stage.addEventListener("pointermove", (event) => (pointer = { x: event.clientX, y: event.clientY }));
stage.addEventListener("pointerleave", () => (pointer = null));
function pictureBelow(place) {
  if (!place) return { right: 0.5, down: 0.5 };
  const corner = stage.getBoundingClientRect();
  const box = pictureBox();
  const right = (place.x - corner.left - box.left) / box.width;
  const down = (place.y - corner.top - box.top) / box.height;
  const isInside = right >= 0 && right <= 1 && down >= 0 && down <= 1;
  return isInside ? { right, down } : null;
}

async function centre(place) {
  const below = pictureBelow(place);
  if (!below || !isOpen) return;
  try {
    const answer = await fetch(`centre?client=${client}&right=${below.right.toFixed(6)}&down=${below.down.toFixed(6)}`, { method: "POST" });
    const found = await answer.json();
    trouble(answer.ok ? "" : sentence(found));
    if (answer.ok) show(found);
  } catch {
    lost();
  }
}
stage.addEventListener("dblclick", (event) => centre({ x: event.clientX, y: event.clientY }));

stage.addEventListener("wheel", (event) => {
  event.preventDefault();
  const pixels = event.deltaMode === 1 ? event.deltaY * 33 : event.deltaY;
  add({ do: "zoom", steps: Math.max(-6, Math.min(6, -pixels / 100)) });
}, { passive: false });

// ---- keys ----

/// Elevation of an eye that sees three axes alike, degrees.
const CORNER = (Math.atan(Math.SQRT1_2) * 180) / Math.PI;
const look = (azimuth, elevation) => add({ do: "look_from", azimuth, elevation });
const keys = {
  "+": () => add({ do: "zoom", steps: 1 }),
  "=": () => add({ do: "zoom", steps: 1 }),
  "-": () => add({ do: "zoom", steps: -1 }),
  "1": () => look(0, 0),
  "3": () => look(90, 0),
  "7": () => look(0, 90),
  "9": () => look(45, CORNER),
  x: () => toggleOverlay("axes-shown"),
  b: () => toggleOverlay("scale-shown"),
  c: () => centre(pointer),
  v: () => toggleCursor(),
  k: () => keep(),
  r: () => add({ do: "reset" }),
  s: () => save("picture.png"),
  h: () => at("keys").showModal(),
  "?": () => at("keys").showModal(),
};
const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/// Texts of a field have steps of their own.
const isText = (input) => input.matches("textarea, input:not([type=range], [type=checkbox], [type=color])");

document.addEventListener("keydown", (event) => {
  const letter = event.key.toLowerCase();
  if ((event.ctrlKey || event.metaKey) && !event.altKey && (letter === "z" || letter === "y") && !isText(event.target)) {
    add({ do: letter === "y" || event.shiftKey ? "redo" : "undo" });
    event.preventDefault();
    return;
  }
  if (event.ctrlKey || event.metaKey || event.altKey || at("keys").open) return;
  const isTyping = event.target.matches("input, select, textarea");
  const arrow = arrows[event.key];
  if (cursor && !isTyping && moveCursor(event)) return;
  if (arrow && !isTyping) {
    const [right, up] = arrow;
    add(event.shiftKey ? { do: "pan", right: right * 0.05, up: up * 0.05 } : { do: "orbit", right: right / 36, up: up / 36 });
    event.preventDefault();
    return;
  }
  if (isTyping && (event.target.type === "number" || event.target.matches("select"))) return;
  if (event.target.closest(".curve")) return;
  const key = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (key) {
    key();
    event.preventDefault();
  }
});

// ---- panels ----

at("reset").addEventListener("click", () => add({ do: "reset" }));
for (const change of ["undo", "redo", "restore"]) at(change).addEventListener("click", () => add({ do: change }));
at("help").addEventListener("click", () => at("keys").showModal());
at("technique").addEventListener("change", () => add({ do: "technique", technique: at("technique").value || null }));
at("layer").addEventListener("change", () => add({ do: "layer", layer: at("layer").value || null }));
at("exposure").addEventListener("input", () => add({ do: "exposure", stops: Number(at("exposure").value) }));

/// As scenes take it, pixels.
const LONGEST_SIDE = 65536;

/// The size of the last whole picture, and whether another one was asked for since.
let goodSize = null;
let isResized = false;

function setSize(width, height) {
  if (width === null || height === null) return;
  isResized = true;
  add({ do: "size", width: Math.round(width), height: Math.round(height) });
}

/// A size that no picture can be drawn in gives way to the last that had one.
function checkSize(found) {
  if (found.is_whole) {
    goodSize = found.size;
    isResized = false;
  }
  if (!isResized || !found.failure || !goodSize) return;
  isResized = false;
  afterwards = `${found.size.width} × ${found.size.height}: ${sentence(found.failure)} The last good size is back.`;
  add({ do: "size", ...goodSize });
}
for (const side of ["width", "height"]) {
  at(side).addEventListener("change", () => {
    const width = numberIn(at("width"), 1, LONGEST_SIDE);
    setSize(width, width === null ? null : numberIn(at("height"), 1, LONGEST_SIDE));
  });
}
// A pixel of the picture is one of the screen.
at("fill").addEventListener("click", () => setSize(stage.clientWidth * devicePixelRatio, stage.clientHeight * devicePixelRatio));

function stemOfTitle() {
  return shown.title.split(", ")[0].replace(/\.gz$/i, "").replace(/\.[^.]*$/, "") || "picture";
}

function download(blob, name) {
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

async function save(what) {
  if (what !== "scene" && !(shown && shown.is_whole)) {
    trouble("The whole picture is not drawn yet; save it when it is.");
    return;
  }
  try {
    const answer = await fetch(`save/${what}?client=${client}`);
    if (!answer.ok) {
      trouble(sentence(await answer.json()));
      return;
    }
    const stem = stemOfTitle();
    const ending = what === "scene" ? (shown.title.endsWith(".json") ? "view.json" : "view.toml") : what.split(".")[1];
    download(await answer.blob(), `${stem}.${ending}`);
    trouble("");
  } catch {
    lost();
  }
}
at("save-png").addEventListener("click", () => save("picture.png"));
at("save-exr").addEventListener("click", () => save("picture.exr"));
at("save-scene").addEventListener("click", () => save("scene"));

// The server ends a while after the last page.
window.addEventListener("pagehide", () => navigator.sendBeacon(`leave?client=${client}`));
// A page that comes back as it was left is a new one to the server.
window.addEventListener("pageshow", (event) => event.persisted && location.reload());

