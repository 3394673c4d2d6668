"use strict";
// Drawn over the picture, and no part of a saved one: the axes of the scene, which turn with the view, and a bar whose length in the scene is known.

/// Lengths of the drawing of the axes, CSS pixels.
const AXES_SIDE = 92;
const AXIS_LENGTH = 34;
const AXIS_END = 9;

/// Longest bar, CSS pixels, and as a share of the width of the picture.
const LONGEST_BAR = 140;
const LONGEST_BAR_SHARE = 0.3;

/// Lines from the middle to the ends of the positive axes, and an end for both sides of each.
const axisLines = [];
const axisEnds = [];
for (const [axis, word] of ["x", "y", "z"].entries()) {
  axisLines.push(svg("line", { class: `axis-${word}` }));
  for (const sign of [1, -1]) {
    const name = `${sign > 0 ? "+" : "−"}${word}`;
    const label = sign > 0 ? [Object.assign(svg("text", {}), { textContent: word })] : [];
    const group = svg("g", { class: `axis-${word} ${sign > 0 ? "axis-front" : "axis-back"}`, role: "button", tabindex: 0, "aria-label": `Look from ${name}` }, [
      Object.assign(svg("title", {}), { textContent: `Look from ${name}` }), svg("circle", { r: AXIS_END }), ...label,
    ]);
    const choose = () => shown && lookFrom(axis, sign);
    group.addEventListener("click", choose);
    group.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      choose();
      event.preventDefault();
    });
    // The picture below takes neither a drag nor a double click from here.
    for (const kind of ["pointerdown", "dblclick"]) group.addEventListener(kind, (event) => event.stopPropagation());
    axisEnds.push({ axis, sign, group });
  }
}
at("axes").setAttribute("viewBox", `${-AXES_SIDE / 2} ${-AXES_SIDE / 2} ${AXES_SIDE} ${AXES_SIDE}`);
at("axes").append(...axisLines, ...axisEnds.map((end) => end.group));

function svg(name, values, children = []) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(values)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/// Looks against the direction of an axis.
function lookFrom(axis, sign) {
  const { azimuth, elevation } = shown.viewpoint.axes[axis];
  const opposite = azimuth > 0 ? azimuth - 180 : azimuth + 180;
  // From both poles the picture is turned alike.
  const isPole = Math.abs(elevation) > 89.9;
  look(sign > 0 || isPole ? azimuth : opposite, sign * elevation);
}

/// Ends nearer to the eye are drawn over the others.
function showAxes(eye) {
  const towards = towardsEye();
  const place = (axis, length) => ({ x: length * eye.right[axis], y: -length * eye.up[axis] });
  axisLines.forEach((line, axis) => {
    const { x, y } = place(axis, AXIS_LENGTH - AXIS_END);
    line.setAttribute("x2", x);
    line.setAttribute("y2", y);
  });
  for (const { axis, sign, group } of axisEnds) {
    const { x, y } = place(axis, sign * AXIS_LENGTH);
    group.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
  }
  const nearness = ({ axis, sign }) => sign * towards[axis];
  const order = [...axisEnds].sort((a, b) => nearness(a) - nearness(b)).map((end) => end.group);
  const drawn = [...at("axes").querySelectorAll("g")];
  // What has the focus loses it where it is put anew.
  if (order.some((group, k) => group !== drawn[k]) && !at("axes").contains(document.activeElement)) at("axes").append(...order);
}

/// The largest of 1, 2 and 5 times a power of ten that is not above a length.
function roundLength(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  const first = [5, 2, 1].find((digit) => digit * power <= length * (1 + 1e-9)) || 1;
  return Number((first * power).toPrecision(1));
}

function showScale(found) {
  const eye = found.viewpoint;
  const { width, height } = pictureBox();
  const pixels = height / eye.height;
  const length = roundLength(Math.min(LONGEST_BAR, LONGEST_BAR_SHARE * width) / pixels);
  at("scale").hidden = !at("scale-shown").checked || !(length > 0 && Number.isFinite(length));
  at("scale-bar").style.width = `${length * pixels}px`;
  const name = length === 1 ? "1 unit" : `${length} units`;
  at("scale-text").textContent = eye.is_parallel ? name : `${name} at the centre`;
  at("scale").title = eye.is_parallel
    ? "Length in world units"
    : "Length in world units at the depth of the centre that the view turns around; what is nearer looks larger";
}

function showOverlay(found) {
  at("axes").toggleAttribute("hidden", !at("axes-shown").checked);
  showAxes(found.viewpoint);
  showScale(found);
}

function toggleOverlay(id) {
  at(id).checked = !at(id).checked;
  if (shown) showOverlay(shown);
}
for (const id of ["axes-shown", "scale-shown"]) at(id).addEventListener("change", () => shown && showOverlay(shown));
new ResizeObserver(() => shown && showOverlay(shown)).observe(stage);
