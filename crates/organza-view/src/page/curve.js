"use strict";
// The transfer function of a volume, drawn over how often its values occur. Knots are dragged, added by a double click, removed by Delete; the ground is
// dragged to shift all knots (level) and to spread them (window).

function colorText(color) {
  return `rgb(${color.map((linear) => {
    const x = Math.min(1, Math.max(0, linear));
    return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  }).join(" ")})`;
}

function hexOf(color) {
  return `#${colorText(color).match(/\d+/g).map((byte) => Number(byte).toString(16).padStart(2, "0")).join("")}`;
}

function linearOf(hex) {
  return [1, 3, 5].map((start) => {
    const x = parseInt(hex.slice(start, start + 2), 16) / 255;
    return Number((x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4).toPrecision(6));
  });
}

/// The largest number of single precision, which scenes have for values and extinctions.
const MOST_NUMBER = 3.4e38;

class Curve {
  /// `take` gets the knots whenever a hand has changed them, and null for those of the scene.
  constructor(name, take) {
    this.take = take;
    this.knots = [];
    this.values = null;
    this.chosen = 0;
    this.held = null;
    this.canvas = Object.assign(document.createElement("canvas"), { width: 584, height: 240, tabIndex: 0 });
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", `Curve of ${name}: Page Up and Page Down choose a knot, arrow keys move it, Insert adds one, Delete removes it`);
    this.value = this.field("Value", "number");
    this.extinction = this.field("Extinction", "number");
    this.color = this.field("Colour", "color");
    const button = (text, act) => {
      const made = Object.assign(document.createElement("button"), { type: "button", textContent: text });
      made.addEventListener("click", act);
      return made;
    };
    const presets = document.createElement("select");
    presets.setAttribute("aria-label", `Preset for the curve of ${name}`);
    for (const [value, text] of [["", "Preset …"], ["scene", "as in the scene"], ["ramp", "ramp"], ["skin", "outer surface"], ["core", "brightest parts"], ["peaks", "three layers"]]) {
      presets.append(Object.assign(document.createElement("option"), { value, textContent: text }));
    }
    presets.addEventListener("change", () => {
      if (presets.value) this.preset(presets.value);
      presets.value = "";
    });
    const row = document.createElement("div");
    row.className = "curve-fields";
    row.append(this.value.label, this.extinction.label, this.color.label);
    const buttons = document.createElement("div");
    buttons.className = "curve-buttons";
    buttons.append(button("Add knot", () => this.add()), button("Remove knot", () => this.remove()), presets);
    this.panel = document.createElement("details");
    this.panel.className = "curve";
    this.panel.open = true;
    const summary = document.createElement("summary");
    summary.textContent = "Curve";
    this.panel.append(summary, this.canvas, row, buttons);
    this.listen();
  }

  field(text, type) {
    const input = Object.assign(document.createElement("input"), { type });
    if (type === "number") input.step = "any";
    input.addEventListener(type === "color" ? "input" : "change", () => this.typed());
    const label = document.createElement("label");
    label.append(Object.assign(document.createElement("span"), { textContent: text }), input);
    return { input, label };
  }

  show(found) {
    this.values = found.values;
    // What a hand holds is newer than what comes back.
    if (!this.held) {
      this.knots = found.knots.map((knot) => ({ ...knot, color: [...knot.color] }));
      this.chosen = Math.min(this.chosen, this.knots.length - 1);
    }
    this.draw();
  }

  /// The values that the panel shows, with room beside the outermost.
  range() {
    const knots = this.knots.map((knot) => knot.value);
    const low = Math.min(...knots, this.values ? this.values.low : knots[0]);
    const high = Math.max(...knots, this.values ? this.values.high : knots[knots.length - 1]);
    const room = 0.04 * (high - low || 1);
    return this.held ? this.held.range : [low - room, high + room];
  }

  most() {
    return this.held ? this.held.most : Math.max(1e-12, ...this.knots.map((knot) => knot.extinction)) * 1.1;
  }

  // Small extinctions matter, too: heights are roots of shares.
  toX(value) {
    const [low, high] = this.range();
    return ((value - low) / (high - low)) * this.canvas.width;
  }

  toY(extinction) {
    return this.canvas.height - 8 - Math.sqrt(Math.min(1, Math.max(0, extinction / this.most()))) * (this.canvas.height - 16);
  }

  valueAt(x) {
    const [low, high] = this.range();
    return low + (x / this.canvas.width) * (high - low);
  }

  extinctionAt(y) {
    const share = Math.max(0, (this.canvas.height - 8 - y) / (this.canvas.height - 16));
    return this.most() * share * share;
  }

  draw() {
    // Two pixels for one of the page, however wide the panel is: knots stay round.
    const pixels = 2 * this.canvas.clientWidth;
    if (pixels > 0 && this.canvas.width !== pixels) this.canvas.width = pixels;
    const pen = this.canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    const { width, height } = this.canvas;
    pen.clearRect(0, 0, width, height);
    if (this.values) {
      pen.fillStyle = style.getPropertyValue("--line");
      const { low, high, heights } = this.values;
      const step = (high - low) / heights.length;
      heights.forEach((share, bin) => {
        const x = this.toX(low + bin * step);
        pen.fillRect(x, height - share * (height - 16), Math.max(1, this.toX(low + (bin + 1) * step) - x), share * (height - 16));
      });
    }
    pen.strokeStyle = style.getPropertyValue("--text");
    pen.lineWidth = 3;
    pen.beginPath();
    const [first, last] = [this.knots[0], this.knots[this.knots.length - 1]];
    pen.moveTo(0, this.toY(first.extinction));
    // Between knots extinction is even, which roots bend.
    this.knots.forEach((knot, i) => {
      const before = this.knots[i - 1] || knot;
      for (let step = 1; step <= 12; step += 1) {
        const share = step / 12;
        pen.lineTo(this.toX(before.value + (knot.value - before.value) * share), this.toY(before.extinction + (knot.extinction - before.extinction) * share));
      }
    });
    pen.lineTo(width, this.toY(last.extinction));
    pen.stroke();
    this.knots.forEach((knot, i) => {
      pen.beginPath();
      pen.arc(this.toX(knot.value), this.toY(knot.extinction), i === this.chosen ? 12 : 9, 0, 2 * Math.PI);
      pen.fillStyle = colorText(knot.color);
      pen.fill();
      pen.strokeStyle = style.getPropertyValue(i === this.chosen ? "--accent" : "--text");
      pen.lineWidth = i === this.chosen ? 5 : 2.5;
      pen.stroke();
    });
    const knot = this.knots[this.chosen];
    for (const [field, value] of [[this.value, Number(knot.value.toPrecision(6))], [this.extinction, Number(knot.extinction.toPrecision(4))], [this.color, hexOf(knot.color)]]) {
      if (!isHeld(field.input)) field.input.value = value;
    }
  }

  /// Values rise: a knot stays between its neighbours.
  between(i, value) {
    const [low, high] = this.range();
    const least = (high - low) * 1e-4;
    const before = i > 0 ? this.knots[i - 1].value + least : -Infinity;
    const behind = i + 1 < this.knots.length ? this.knots[i + 1].value - least : Infinity;
    return Math.max(before, Math.min(behind, value));
  }

  /// The value that was typed for a knot, where it is between its neighbours; else the page says so, and there is none.
  typedValue(i) {
    const before = i > 0 ? this.knots[i - 1].value : -MOST_NUMBER;
    const behind = i + 1 < this.knots.length ? this.knots[i + 1].value : MOST_NUMBER;
    const value = numberIn(this.value.input, before, behind);
    return value === null ? null : this.between(i, value);
  }

  changed() {
    this.draw();
    this.take(this.knots);
  }

  typed() {
    const knot = this.knots[this.chosen];
    // Fields show rounded numbers: only those that were typed are taken.
    const isTyped = ({ input }) => document.activeElement === input;
    const value = isTyped(this.value) ? this.typedValue(this.chosen) : knot.value;
    const extinction = isTyped(this.extinction) ? numberIn(this.extinction.input, 0, MOST_NUMBER) : knot.extinction;
    if (value === null || extinction === null) return;
    knot.value = value;
    knot.extinction = extinction;
    if (hexOf(knot.color) !== this.color.input.value) knot.color = linearOf(this.color.input.value);
    this.changed();
  }

  /// Colour and extinction between knots.
  at(value) {
    const behind = this.knots.findIndex((knot) => knot.value > value);
    if (behind === 0) return this.knots[0];
    if (behind < 0) return this.knots[this.knots.length - 1];
    const [a, b] = [this.knots[behind - 1], this.knots[behind]];
    const share = (value - a.value) / (b.value - a.value);
    const mix = (x, y) => x + (y - x) * share;
    return { extinction: mix(a.extinction, b.extinction), color: a.color.map((x, i) => mix(x, b.color[i])) };
  }

  addAt(value, extinction) {
    if (this.knots.length >= 256 || this.knots.some((knot) => knot.value === value)) return;
    const found = this.at(value);
    const knot = { value, color: [...found.color], extinction: extinction === undefined ? found.extinction : extinction };
    const behind = this.knots.findIndex((other) => other.value > value);
    this.chosen = behind < 0 ? this.knots.length : behind;
    this.knots.splice(this.chosen, 0, knot);
    this.changed();
  }

  /// In the middle between the chosen knot and the next.
  add() {
    const knot = this.knots[this.chosen];
    const next = this.knots[this.chosen + 1] || { value: this.range()[1] };
    this.addAt((knot.value + next.value) / 2);
  }

  remove() {
    if (this.knots.length < 2) return;
    this.knots.splice(this.chosen, 1);
    this.chosen = Math.max(0, this.chosen - 1);
    this.changed();
  }

  preset(name) {
    if (name === "scene") {
      this.take(null);
      return;
    }
    const [low, high] = this.values ? [this.values.low, this.values.high] : this.range();
    const most = this.most() / 1.1;
    const knot = (share, part, color) => ({ value: Number((low + (high - low) * share).toPrecision(6)), color, extinction: Number((most * part).toPrecision(4)) });
    const [bone, skin, red, blue] = [[0.9, 0.85, 0.75], [0.8, 0.5, 0.35], [0.7, 0.12, 0.08], [0.1, 0.25, 0.7]];
    this.knots = {
      ramp: [knot(0.05, 0, skin), knot(1, 1, bone)],
      skin: [knot(0.1, 0, skin), knot(0.2, 0.5, skin), knot(0.3, 0.5, skin), knot(0.4, 0, skin)],
      core: [knot(0.55, 0, skin), knot(0.75, 1, bone), knot(1, 1, bone)],
      peaks: [knot(0.1, 0, skin), knot(0.2, 0.15, skin), knot(0.3, 0, skin), knot(0.4, 0, red), knot(0.5, 0.4, red), knot(0.6, 0, red), knot(0.7, 0, blue), knot(0.85, 1, blue), knot(1, 1, bone)],
    }[name];
    this.chosen = 0;
    this.changed();
  }

  listen() {
    const place = (event) => {
      const box = this.canvas.getBoundingClientRect();
      return { x: ((event.clientX - box.left) / box.width) * this.canvas.width, y: ((event.clientY - box.top) / box.height) * this.canvas.height };
    };
    const below = ({ x, y }) => {
      const near = this.knots.map((knot, i) => ({ i, far: Math.hypot(this.toX(knot.value) - x, this.toY(knot.extinction) - y) }));
      near.sort((a, b) => a.far - b.far);
      return near[0].far < 30 ? near[0].i : null;
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      const start = place(event);
      const knot = below(start);
      this.canvas.setPointerCapture(event.pointerId);
      this.held = { knot, start, range: this.range(), most: this.most(), knots: this.knots.map((k) => ({ ...k })) };
      if (knot !== null) this.chosen = knot;
      this.draw();
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!this.held) return;
      const { x, y } = place(event);
      const { knot, start, knots, range } = this.held;
      if (Math.hypot(x - start.x, y - start.y) < 3) return;
      if (knot !== null) {
        this.knots[knot].value = this.between(knot, Number(this.valueAt(x).toPrecision(6)));
        this.knots[knot].extinction = Number(this.extinctionAt(y).toPrecision(4));
      } else {
        // To the side is the level, up and down the window around the middle of all knots.
        const shift = ((x - start.x) / this.canvas.width) * (range[1] - range[0]);
        const spread = 2 ** ((start.y - y) / this.canvas.height * 2);
        const middle = (knots[0].value + knots[knots.length - 1].value) / 2;
        this.knots.forEach((k, i) => (k.value = Number((middle + shift + (knots[i].value - middle) * spread).toPrecision(6))));
      }
      this.changed();
    });
    const release = () => {
      this.held = null;
      this.draw();
    };
    this.canvas.addEventListener("pointerup", release);
    this.canvas.addEventListener("pointercancel", release);
    this.canvas.addEventListener("dblclick", (event) => {
      const found = place(event);
      if (below(found) === null) this.addAt(Number(this.valueAt(found.x).toPrecision(6)), Number(this.extinctionAt(found.y).toPrecision(4)));
    });
    this.canvas.addEventListener("keydown", (event) => {
      const knot = this.knots[this.chosen];
      const [low, high] = this.range();
      const move = (value, share) => {
        knot.value = this.between(this.chosen, Number((knot.value + value * (high - low)).toPrecision(6)));
        const root = Math.max(0, Math.sqrt(knot.extinction / this.most()) + share);
        if (share !== 0) knot.extinction = Number((this.most() * root * root).toPrecision(4));
        this.changed();
      };
      const act = {
        ArrowLeft: () => move(-0.01, 0),
        ArrowRight: () => move(0.01, 0),
        ArrowUp: () => move(0, 0.03),
        ArrowDown: () => move(0, -0.03),
        PageUp: () => { this.chosen = Math.min(this.knots.length - 1, this.chosen + 1); this.draw(); },
        PageDown: () => { this.chosen = Math.max(0, this.chosen - 1); this.draw(); },
        Insert: () => this.add(),
        Delete: () => this.remove(),
        Backspace: () => this.remove(),
      }[event.key];
      if (!act) return;
      act();
      event.preventDefault();
      event.stopPropagation();
    });
  }
}
