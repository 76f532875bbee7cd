// The page of a scenario: sliders, curves and figures, computed in the page itself.

import { Scenario, bytesOf } from "./bristle.mjs";

/** Colours by the names that the page's style gives them: light and dark. */
const themed = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const part = (id) => document.getElementById(id);

function number(value, digits = 4) {
  if (!Number.isFinite(value)) return "-";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e6)) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(digits)));
}

/** Returns marks of an axis that are round numbers. */
function marks(low, high, wanted) {
  const rough = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((one) => one >= rough);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high * (1 + 1e-12); k++) found.push(k * step);
  return found;
}

function range(columns) {
  let low = Infinity;
  let high = -Infinity;
  for (const column of columns) {
    for (const value of column) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!(high > low)) [low, high] = Number.isFinite(low) ? [low - 1, low + 1] : [-1, 1];
  const room = 0.05 * (high - low);
  return [low - room, high + room];
}

/** Draws curves [{x, y, colour}] on a canvas. */
function draw(canvas, curves, xName, yName, tightX) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const c = canvas.getContext("2d");
  c.scale(ratio, ratio);
  c.clearRect(0, 0, width, height);
  const [left, right, top, bottom] = [64, 12, 10, 40];
  const last = curves[0].x;
  const [x0, x1] = tightX ? [last[0], last[last.length - 1]] : range(curves.map((one) => one.x));
  const [y0, y1] = range(curves.map((one) => one.y));
  const px = (x) => left + ((x - x0) / (x1 - x0)) * (width - left - right);
  const py = (y) => height - bottom - ((y - y0) / (y1 - y0)) * (height - top - bottom);
  c.font = '12px "Segoe UI", "Helvetica Neue", Helvetica, Arial, sans-serif';
  c.fillStyle = themed("soft");
  c.strokeStyle = themed("line");
  c.lineWidth = 1;
  c.textAlign = "center";
  c.textBaseline = "top";
  for (const x of marks(x0, x1, 7)) {
    c.beginPath();
    c.moveTo(px(x), top);
    c.lineTo(px(x), height - bottom);
    c.stroke();
    c.fillText(number(x), px(x), height - bottom + 5);
  }
  c.fillText(xName, 0.5 * (left + width - right), height - 17);
  c.textAlign = "right";
  c.textBaseline = "middle";
  for (const y of marks(y0, y1, 5)) {
    c.beginPath();
    c.moveTo(left, py(y));
    c.lineTo(width - right, py(y));
    c.stroke();
    c.fillText(number(y), left - 6, py(y));
  }
  c.save();
  c.translate(13, 0.5 * (top + height - bottom));
  c.rotate(-Math.PI / 2);
  c.textAlign = "center";
  c.fillText(yName, 0, 0);
  c.restore();
  for (const { x, y, colour } of curves) {
    c.strokeStyle = colour;
    c.lineWidth = 1.2;
    c.lineJoin = "round";
    c.beginPath();
    for (let k = 0; k < x.length; k++) c.lineTo(px(x[k]), py(y[k]));
    c.stroke();
  }
}

class Page {
  constructor(scenario) {
    this.scenario = scenario;
    this.before = scenario.run();
    this.now = this.before;
    this.values = Object.fromEntries(scenario.sliders.map((one) => [one.name, one.value]));
    this.waiting = false;
    this.units = Object.fromEntries(scenario.description.outputs.map((o) => [o.name, o.unit]));
    this.measured = scenario.description.measured; // output to the one of its measured values
    part("black").hidden = Object.keys(this.measured).length === 0;
    this.addSliders();
    for (const [id, name] of Object.entries(this.first())) this.addChoice(id, name);
    this.loopFirst();
    window.addEventListener("resize", () => this.show());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show());
    part("back").addEventListener("click", () => this.back());
    this.show();
  }

  /** Returns which outputs are shown first. */
  first() {
    const names = this.scenario.description.outputs.map((one) => one.name);
    const like = (...words) => words.map((w) => names.find((n) => n.endsWith(w))).find(Boolean);
    const top = names.filter((n) => n.endsWith("_acceleration_absolute")).pop();
    const moved = like("base_displacement", "displacement", ".value") ?? names[0];
    const force = like(".force") ?? names[names.length - 1];
    const compared = Object.keys(this.measured)[0];
    return { first: compared ?? top ?? force, second: moved, across: moved, along: force };
  }

  /** Puts the loop before the curves where there is no building: a damper is known by its loop. */
  loopFirst() {
    const building = this.scenario.description.outputs.some((one) => one.name.endsWith("_acceleration_absolute"));
    const loop = part("loop-picture").closest("figure");
    if (!building) loop.parentElement.prepend(loop);
  }

  addChoice(id, chosen) {
    const select = part(id);
    for (const { name } of this.scenario.description.outputs) {
      select.append(new Option(name, name, name === chosen, name === chosen));
    }
    select.addEventListener("change", () => this.show());
  }

  addSliders() {
    for (const slider of this.scenario.sliders) {
      const row = document.createElement("label");
      row.className = "slider";
      const name = document.createElement("span");
      name.textContent = slider.name;
      const shown = document.createElement("output");
      const input = document.createElement("input");
      input.type = "range";
      input.id = `slider-${slider.name}`;
      row.htmlFor = input.id; // else the label would be that of the output
      input.min = "0";
      input.max = "1000";
      input.step = "any";
      const say = (value) => {
        shown.textContent = `${number(value)} ${slider.unit === "1" ? "" : slider.unit}`;
      };
      const put = (value) => {
        input.value = String((1000 * (value - slider.low)) / (slider.high - slider.low));
        say(value);
      };
      put(slider.value);
      input.addEventListener("input", () => {
        const share = Number(input.value) / 1000;
        const value = slider.low + share * (slider.high - slider.low);
        this.values[slider.name] = Math.min(Math.max(value, slider.low), slider.high);
        say(this.values[slider.name]);
        this.later();
      });
      row.put = () => put(slider.value);
      const text = document.createElement("small");
      text.textContent = slider.text;
      row.append(name, shown, input, text);
      part("sliders").append(row);
    }
  }

  back() {
    for (const slider of this.scenario.sliders) this.values[slider.name] = slider.value;
    for (const row of part("sliders").children) row.put();
    this.later();
  }

  /** Runs once per picture of the screen, however fast a slider moves. */
  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const begin = performance.now();
      this.now = this.scenario.run(this.values);
      const took = performance.now() - begin;
      part("took").textContent = `${this.now.rows} rows in ${took.toFixed(0)} ms.`;
      this.show();
    });
  }

  show() {
    const unit = (port) => (this.units[port] && this.units[port] !== "1" ? this.units[port] : "");
    const name = (port) => (unit(port) ? `${port} [${unit(port)}]` : port);
    const runs = [
      [this.before, themed("mark")],
      [this.now, themed("blue")],
    ];
    for (const id of ["first", "second"]) {
      const port = part(id).value;
      const curves = runs.map(([run, colour]) => ({ x: run.time, y: run.column(port), colour }));
      curves.unshift(...this.beside(port, this.before.time));
      draw(part(`${id}-picture`), curves, "time [s]", unit(port), true);
    }
    const [across, along] = [part("across").value, part("along").value];
    const loops = runs.map(([run, colour]) => ({
      x: run.column(across),
      y: run.column(along),
      colour,
    }));
    loops.unshift(...this.beside(along, this.before.column(across)));
    draw(part("loop-picture"), loops, name(across), unit(along), false);
    this.tell();
  }

  /** Returns the measured curve of an output over x, if there is one. */
  beside(port, x) {
    const name = this.measured[port];
    return name ? [{ x, y: this.before.column(name), colour: themed("ink") }] : [];
  }

  /** Says how far outputs are from what was measured. */
  tellApart() {
    const apart = (run, port) => {
      const [is, was] = [run.column(port), this.before.column(this.measured[port])];
      return Math.sqrt(is.reduce((sum, one, k) => sum + (one - was[k]) ** 2, 0) / is.length);
    };
    part("apart").textContent = Object.keys(this.measured)
      .map((port) => {
        const sizes = [this.before, this.now].map((run) => number(apart(run, port), 3));
        const unit = this.units[port] ?? "";
        return `RMS of ${port} minus measured: ${sizes[0]} ${unit}, now ${sizes[1]} ${unit}.`;
      })
      .join(" ");
  }

  /** Says where a damper leaves the data that its model is from, beyond 5 % as `bristle run`. */
  tellOutside() {
    const names = this.scenario.description.outputs.map((one) => one.name);
    const left = names.filter((n) => n.endsWith(".outside") && this.now.figures(n).peak > 0.05);
    const said = left.map((name) => {
      const first = this.now.time[this.now.column(name).findIndex((one) => one > 0)];
      const most = (100 * this.now.figures(name).peak).toFixed(0);
      return `${name}: up to ${most} % beyond the data that the model is from, first at t = ${number(first)} s.`;
    });
    part("outside").textContent = said.join(" ");
    part("outside").hidden = said.length === 0;
  }

  tell() {
    this.tellApart();
    this.tellOutside();
    const body = part("figures");
    body.replaceChildren();
    for (const { name, unit } of this.scenario.description.outputs) {
      const [before, now] = [this.before.figures(name), this.now.figures(name)];
      const row = body.insertRow();
      row.insertCell().textContent = unit && unit !== "1" ? `${name} [${unit}]` : name;
      for (const value of [before.peak, now.peak, before.rms, now.rms]) {
        const cell = row.insertCell();
        cell.className = "n";
        cell.textContent = number(value);
      }
    }
    part("stopped").hidden = this.now.complete;
  }
}

const description = JSON.parse(part("scenario").textContent);
Scenario.load(bytesOf(part("module").textContent.trim()), description).then(
  (scenario) => new Page(scenario),
  (error) => {
    part("stopped").hidden = false;
    part("stopped").textContent = `This browser cannot run the scenario: ${error.message}`;
  },
);
