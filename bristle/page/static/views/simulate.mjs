// View 7, Simulate: a building that moves, sliders, two settings compared.

import { packed, postPacked } from "../api.mjs";
import { h, key, number, shown, table, unitText } from "../dom.mjs";
import { Plot, colour, extent } from "../plot.mjs";

const FIRST = "el_centro_lugre_passive";

export async function show(page) {
  const { scenarios, studies } = await packed("scenarios");
  const scenario = page.scenario ?? FIRST;
  const study = page.damper ?? "";
  const select = (id, options, chosen, then) => {
    const made = h("select", { id }, options.map(([value, text]) => h("option", { value, selected: value === chosen }, text)));
    made.addEventListener("change", () => {
      then(made.value);
      page.again();
    });
    return made;
  };
  const whole = h("div", {}, h("p", { class: "loading", role: "status" },
    "Running the scenario; the first time all laws are compiled, which takes a minute …"));
  const head = [
    h("h1", {}, "Simulate"),
    h("div", { class: "act" },
      h("label", { class: "field", for: "scenario" }, "Scenario",
        select("scenario", scenarios.map((one) => [one, one]), scenario, (value) => (page.scenario = value))),
      h("label", { class: "field", for: "damper" }, "Damper",
        select("damper", [["", "the scenario's"], ...studies.map((one) => [one, `that of ${one}`])], study, (value) => (page.damper = value)))),
    whole,
  ];
  postPacked("simulate", { scenario, study, values: {}, about: true }).then(
    (first) => new Simulation(page, { scenario, study }, first, whole),
    (error) => whole.replaceChildren(page.failure(error)),
  );
  return head;
}

class Simulation {
  constructor(page, what, first, whole) {
    Object.assign(this, { page, what, before: first, now: first, whole, sliders: first.sliders });
    this.values = {};
    this.names = first.outputs.map((one) => one.name);
    this.at = 0; // row that is shown of the building
    this.busy = false;
    this.wanted = false;
    this.took = h("p", { class: "soft small", role: "status" });
    this.build();
    this.finish();
    window.bristleSimulation = this;
  }

  output(run, name) {
    return run.outputs.find((one) => one.name === name);
  }

  like(...ends) {
    return ends.map((end) => this.names.find((name) => name.endsWith(end))).find(Boolean);
  }

  /** The levels of the structure, lowest first: name and displacement relative to the ground. */
  levels() {
    const found = this.names.map((name) => /^(\w+)\.(base|floor\d+)_displacement$/.exec(name)).filter(Boolean);
    const order = (level) => (level === "base" ? 0 : Number(level.slice(5)));
    return found.sort((a, b) => order(a[2]) - order(b[2])).map((one) => ({ level: one[2], name: one[0] }));
  }

  build() {
    const { before } = this;
    const top = this.names.filter((name) => name.endsWith("_acceleration_absolute")).pop();
    const moved = this.like("base_displacement", "floor1_displacement", "displacement", ".value") ?? this.names[0];
    const force = this.like("damper.force", ".force");
    this.shown = { first: top ?? moved, second: moved, along: force ?? this.names[0], across: moved };
    const choice = (id, label) => {
      const select = h("select", { id }, this.names.map((name) => h("option", { value: name, selected: name === this.shown[id] }, name)));
      select.addEventListener("change", () => {
        this.shown[id] = select.value;
        this.draw();
      });
      return h("label", { class: "field", for: id }, label, select);
    };
    this.plots = [];
    const over = (id) => this.plot("", `${this.shown[id]} over time, before and now`, (p) => {
      const [a, b] = [this.before, this.now].map((run) => ({ t: run.time, one: this.output(run, this.shown[id]) }));
      const [factor, unit] = shown(b.one.unit);
      p.axes([b.t[0], b.t.at(-1)], extent([a.one.values, b.one.values], 0.05, factor), "time [s]", unit);
      if (this.before !== this.now) p.trace(a.t, a.one.values, "mark", { fy: factor, width: 1 });
      p.trace(b.t, b.one.values, "blue", { fy: factor, width: 1.1 });
      p.band(b.t[this.at], b.t[this.at], "red");
    });
    const loop = this.plot("high", "one output over another, before and now", (p) => {
      const pick = (run) => [this.output(run, this.shown.across), this.output(run, this.shown.along)];
      const [[ax, ay], [bx, by]] = [pick(this.before), pick(this.now)];
      const [[fx, ux], [fy, uy]] = [shown(bx.unit), shown(by.unit)];
      p.axes(extent([ax.values, bx.values], 0.05, fx), extent([ay.values, by.values], 0.05, fy), `${this.shown.across}${unitText(ux)}`, uy);
      if (this.before !== this.now) p.line(ax.values, ay.values, "mark", { fx, fy, width: 0.9 });
      p.line(bx.values, by.values, "blue", { fx, fy, width: 1 });
    });
    const levels = this.levels();
    this.figures = h("div", {});
    this.keep = h("button", { type: "button", onclick: () => {
      this.before = this.now;
      this.finish();
    } }, "Compare with this");
    const back = h("button", { type: "button", onclick: () => this.back() }, "As the scenario is");
    this.whole.replaceChildren(
      h("p", { class: "lead" }, before.title ?? ""),
      h("div", { class: "bench" },
        h("form", { "aria-label": "Sliders", onsubmit: (event) => event.preventDefault() },
          this.sliders.map((slider) => this.slider(slider)),
          h("div", { class: "act" }, back, this.keep), this.took),
        h("div", {},
          levels.length > 0 ? this.building(levels) : null,
          h("figure", {}, choice("first", "Over time"), over("first").canvas),
          h("figure", {}, choice("second", "Over time"), over("second").canvas),
          h("figure", {}, h("div", { class: "act" }, choice("along", "Output"), choice("across", "over")), loop.canvas),
          key(["mark", "before"], ["blue", "now"]))),
      this.figures);
  }

  plot(kind, label, draw) {
    const made = new Plot(kind, label, draw);
    this.plots.push(made);
    return made;
  }

  slider(slider) {
    const shownValue = h("output", {});
    const id = `slider-${slider.name}`; // the label is the input's: an output could have it, too
    const input = h("input", { id, type: "range", min: 0, max: 1000, step: "any" });
    const say = (value) => (shownValue.textContent = `${number(value, 4)} ${slider.unit === "1" ? "" : slider.unit}`);
    const put = (value) => {
      input.value = String((1000 * (value - slider.low)) / (slider.high - slider.low));
      input.setAttribute("aria-valuetext", say(value));
    };
    put(slider.value);
    input.addEventListener("input", () => {
      const value = slider.low + (Number(input.value) / 1000) * (slider.high - slider.low);
      this.values[slider.name] = Number(Math.min(Math.max(value, slider.low), slider.high).toPrecision(5));
      input.setAttribute("aria-valuetext", say(value));
      this.run();
    });
    slider.put = () => put(slider.value);
    return h("label", { class: "slider", for: id }, h("span", {}, slider.name), shownValue, h("small", {}, slider.text), input);
  }

  back() {
    this.values = {};
    for (const slider of this.sliders) slider.put();
    this.run();
  }

  /** Asks the coupled engine; while it answers, only the newest wish is kept. */
  async run() {
    this.wanted = true;
    if (this.busy) return;
    this.busy = true;
    while (this.wanted) {
      this.wanted = false;
      const began = performance.now();
      try {
        this.now = await postPacked("simulate", { ...this.what, values: this.values });
        this.finish();
        const took = performance.now() - began;
        this.took.textContent = `${this.now.time.length} rows in ${took.toFixed(0)} ms.`;
        this.last = took;
      } catch (error) {
        this.took.textContent = error.message;
      }
    }
    this.busy = false;
  }

  finish() {
    this.at = Math.min(this.at, this.now.time.length - 1);
    this.draw();
    this.tell();
    this.page.same(this.now.command);
    this.page.showJobs();
  }

  draw() {
    for (const plot of this.plots) plot.later();
  }

  tell() {
    const rows = this.now.outputs.map((one) => {
      const before = this.output(this.before, one.name);
      const [factor, unit] = shown(one.unit);
      return [`${one.name}${unitText(unit)}`, ...[before.peak, one.peak, before.rms, one.rms].map((value) => number(factor * value, 4))];
    });
    this.figures.replaceChildren(table("Peak and RMS", ["output", "peak, before", "peak, now", "RMS, before", "RMS, now"], rows, [1, 2, 3, 4]));
  }

  /** The building as it moves, its displacements enlarged, with play and a slider of time. */
  building(levels) {
    const plot = this.plot("middle", "the building as it moves", (p) => this.drawBuilding(p, levels));
    const scrub = h("input", { type: "range", min: 0, max: 1000, step: "any", value: 0, "aria-label": "time of the picture" });
    const time = h("output", { class: "soft" }, "0.0 s");
    const play = h("button", { type: "button" }, "Play");
    const show = () => {
      time.textContent = `${this.now.time[this.at].toFixed(1)} s`;
      scrub.value = String((1000 * this.at) / (this.now.time.length - 1));
      scrub.setAttribute("aria-valuetext", time.textContent);
      this.draw();
    };
    scrub.addEventListener("input", () => {
      this.at = Math.round((Number(scrub.value) / 1000) * (this.now.time.length - 1));
      show();
    });
    let playing = false;
    play.addEventListener("click", () => {
      playing = !playing;
      play.textContent = playing ? "Pause" : "Play";
      const end = this.now.time.length - 1;
      if (this.at >= end) this.at = 0;
      const [from, began] = [this.now.time[this.at], performance.now()];
      const step = () => {
        if (!playing || !plot.canvas.isConnected) return;
        const wanted = from + (performance.now() - began) / 1000;
        const dt = this.now.time[1] - this.now.time[0];
        this.at = Math.min(this.now.time.length - 1, Math.round(wanted / dt));
        show();
        if (this.at < this.now.time.length - 1) requestAnimationFrame(step);
        else {
          playing = false;
          play.textContent = "Play";
        }
      };
      requestAnimationFrame(step);
    });
    return h("figure", {}, plot.canvas, h("div", { class: "play" }, play, scrub, time),
      h("figcaption", {}, "Displacements relative to the ground, enlarged. Grey: before, at the same time."));
  }

  drawBuilding(p, levels) {
    const c = p.c;
    const [width, height] = p.size;
    const runs = [[this.before, "mark"], [this.now, "blue"]];
    let most = 1e-9;
    for (const [run] of runs) for (const one of levels) most = Math.max(most, this.output(run, one.name).peak);
    const floors = levels.length;
    const [ground, top] = [height - 22, 18];
    const rise = (ground - top) / Math.max(1, floors - 1 + 0.6);
    const half = Math.min(0.16 * width, 90);
    const scale = Math.min(0.28 * width, 150) / most;
    c.strokeStyle = colour("mark");
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(0.08 * width, ground);
    c.lineTo(0.92 * width, ground);
    c.stroke();
    for (const [run, name] of runs) {
      const at = Math.min(this.at, run.time.length - 1);
      const places = levels.map((one, k) => [
        0.5 * width + scale * this.output(run, one.name).values[at],
        ground - (levels[0].level === "base" ? 0.35 + k : 1 + k) * rise * (floors > 1 ? 1 : 0.8),
      ]);
      c.strokeStyle = colour(name);
      c.lineWidth = name === "blue" ? 2.4 : 1.2;
      let [x, y] = [0.5 * width, ground];
      places.forEach(([px, py], k) => {
        c.beginPath();
        if (k || levels[0].level !== "base") {
          for (const side of [-half, half]) {
            c.moveTo(x + side, y);
            c.bezierCurveTo(x + side, (y + py) / 2, px + side, (y + py) / 2, px + side, py);
          }
        } else {
          for (const side of [-0.7 * half, 0.7 * half]) {
            c.moveTo(0.5 * width + side, ground);
            c.lineTo(px + side, py);
          }
        }
        c.moveTo(px - half - 6, py);
        c.lineTo(px + half + 6, py);
        c.stroke();
        [x, y] = [px, py];
      });
    }
    c.fillStyle = colour("soft");
    c.textAlign = "left";
    c.textBaseline = "bottom";
    c.fillText(`${number(1e3 * most, 3)} mm at most; enlarged`, 8, height - 3);
  }
}
