// A scenario with sliders: its curves, loops and spectra beside those of a setting that is kept.

import { postPacked } from "./api.mjs";
import { Building, levelsOf } from "./building.mjs";
import { h, key, number, percent, say, shown, table, unitText } from "./dom.mjs";
import { Plot, extent } from "./plot.mjs";

const REST = 250; // ms that sliders rest until the spectra are computed

export class Simulation {
  /** `what` names the run as the server does, `name` is how it is called, `first` its first answer. */
  constructor(page, what, name, first, whole) {
    Object.assign(this, { page, what, name, first, now: first, whole, sliders: first.sliders });
    this.values = {};
    this.names = first.outputs.map((one) => one.name);
    this.busy = false;
    this.wanted = false;
    this.took = h("p", { class: "soft small", role: "status" });
    this.begin = { ...first, label: `${name}, as it is` };
    this.build();
    this.finish();
    window.bristleSimulation = this;
  }

  /** The setting that others are compared with: the one that is kept, else the scenario's. */
  get before() {
    return this.page.kept ?? this.begin;
  }

  output(run, name) {
    return run.outputs.find((one) => one.name === name);
  }

  like(...ends) {
    return ends.map((end) => this.names.find((name) => name.endsWith(end))).find(Boolean);
  }

  /** Both runs, the kept one first, where they have an output and are not the same. */
  pairs(name) {
    const runs = this.before.outputs === this.now.outputs ? [] : [[this.before, "mark"]];
    return [...runs, [this.now, "blue"]].map(([run, colour]) => ({ run, colour, one: this.output(run, name) })).filter(({ one }) => one);
  }

  build() {
    const top = this.names.filter((name) => name.endsWith("_acceleration_absolute")).pop();
    const moved = this.like("base_displacement", "floor1_displacement", "displacement", ".value") ?? this.names[0];
    const force = this.like("damper.force", ".force");
    this.shown = { first: top ?? moved, second: moved, along: force ?? this.names[0], across: moved, spectrum: top };
    const choice = (id, label, names = this.names) => {
      const select = h("select", { id }, names.map((name) => h("option", { value: name, selected: name === this.shown[id] }, name)));
      select.addEventListener("change", () => {
        this.shown[id] = select.value;
        this.draw();
      });
      return h("label", { class: "field", for: id }, label, select);
    };
    this.plots = [];
    const levels = levelsOf(this.names);
    this.building = levels.length ? new Building(this, levels) : null;
    if (this.building) this.plots.push(this.building.plot);
    const over = (id) => this.plot("", `${this.shown[id]} over time, kept and now`, (p) => this.overTime(p, this.shown[id]));
    const loop = this.plot("high", "one output over another, kept and now", (p) => this.loop(p));
    this.keys = h("div", {});
    this.spectrumState = h("p", { class: "soft small", role: "status" });
    this.figures = h("div", {});
    this.forget = h("button", { type: "button", onclick: () => this.keep(null) }, "Drop the kept setting");
    this.whole.replaceChildren(
      h("p", { class: "lead" }, this.first.title ?? ""),
      h("div", { class: "bench" },
        h("form", { "aria-label": "Sliders", onsubmit: (event) => event.preventDefault() },
          this.sliders.map((slider) => this.slider(slider)),
          h("div", { class: "act" },
            h("button", { type: "button", class: "main", onclick: () => this.keep({ ...this.now, spectra: this.spectra, label: this.label() }) }, "Keep this setting"),
            this.forget,
            h("button", { type: "button", onclick: () => this.back() }, "Reset the sliders")),
          this.took),
        h("div", {},
          this.keys,
          this.building?.node,
          h("figure", {}, choice("first", "Over time"), over("first").canvas),
          h("figure", {}, choice("second", "Over time"), over("second").canvas),
          h("div", { class: "grid" },
            h("figure", {}, h("div", { class: "act" }, choice("along", "Output"), choice("across", "over")), loop.canvas),
            this.first.accelerations.length ? this.spectrum(choice) : null))),
      this.figures);
  }

  spectrum(choice) {
    const plot = this.plot("high", "response spectra of absolute acceleration, kept and now", (p) => this.drawSpectrum(p));
    return h("figure", {}, h("div", { class: "act" }, choice("spectrum", "Response spectrum of", this.first.accelerations)), plot.canvas,
      h("figcaption", {}, `Peak absolute acceleration of an oscillator there, ${percent(this.first.damping, 0)} damped, over its period. Dashed: the ground's.`),
      this.spectrumState);
  }

  plot(kind, label, draw) {
    const made = new Plot(kind, label, draw);
    this.plots.push(made);
    return made;
  }

  overTime(p, name) {
    const pairs = this.pairs(name);
    const [factor, unit] = shown(this.output(this.now, name).unit);
    const { time } = this.now;
    p.axes([time[0], time.at(-1)], extent(pairs.map(({ one }) => one.values), 0.05, factor), "time [s]", unit);
    for (const { run, one, colour } of pairs) p.trace(run.time, one.values, colour, { fy: factor, width: colour === "blue" ? 1.1 : 1 });
    if (this.building) p.band(time[this.building.at], time[this.building.at], "red");
  }

  loop(p) {
    const { along, across } = this.shown;
    const pairs = this.pairs(along).map((pair) => ({ ...pair, x: this.output(pair.run, across) })).filter(({ x }) => x);
    const [[fx, ux], [fy, uy]] = [shown(this.output(this.now, across).unit), shown(this.output(this.now, along).unit)];
    p.axes(extent(pairs.map(({ x }) => x.values), 0.05, fx), extent(pairs.map(({ one }) => one.values), 0.05, fy), `${across}${unitText(ux)}`, uy);
    for (const { x, one, colour } of pairs) p.line(x.values, one.values, colour, { fx, fy, width: 1 });
  }

  drawSpectrum(p) {
    const name = this.shown.spectrum;
    const ground = this.first.accelerations.find((one) => one.endsWith("ground_acceleration"));
    const curves = [[this.before.spectra, name, "mark"], [this.spectra, ground, "soft", [4, 4]], [this.spectra, name, "blue"]]
      .filter(([found, one]) => found?.of[one]).map(([found, one, colour, dash]) => ({ x: found.log, y: found.of[one], colour, dash }));
    if (!curves.length) return;
    const most = Math.max(...curves.map(({ y }) => Math.max(...y)));
    p.axes([curves[0].x[0], curves[0].x.at(-1)], [0, 1.06 * most], "period [s]", "m/s²", { logX: true });
    for (const { x, y, colour, dash } of curves) p.line(x, y, colour, { width: colour === "blue" ? 1.8 : 1.3, dash });
  }

  /** Computes the spectra of the present setting, and of the scenario as it is. */
  async askSpectra() {
    if (!this.first.accelerations.length) return;
    const asked = JSON.stringify(this.values);
    this.spectrumState.textContent = "Computing the spectrum …";
    this.spectrumState.classList.add("loading");
    try {
      const found = await postPacked("spectrum", { ...this.what, values: this.values });
      if (asked !== JSON.stringify(this.values)) return;
      this.spectra = { ...found, log: found.period.map(Math.log10) };
      if (asked === "{}") this.begin.spectra = this.spectra;
      this.spectrumState.textContent = "";
      this.tellCommands();
    } catch (error) {
      this.spectra = null;
      this.spectrumState.textContent = error.message;
    }
    this.spectrumState.classList.remove("loading");
    this.draw();
  }

  slider(slider) {
    const shownValue = h("output", {});
    const id = `slider-${slider.name}`; // the label is the input's: an output could have it, too
    const input = h("input", { id, type: "range", min: 0, max: 1000, step: "any" });
    const tell = (value) => (shownValue.textContent = `${number(value, 4)} ${slider.unit === "1" ? "" : slider.unit.replace("s2", "s²")}`);
    const put = (value) => {
      input.value = String((1000 * (value - slider.low)) / (slider.high - slider.low));
      input.setAttribute("aria-valuetext", tell(value));
    };
    put(slider.value);
    input.addEventListener("input", () => {
      const value = Number((slider.low + (Number(input.value) / 1000) * (slider.high - slider.low)).toPrecision(5));
      this.values[slider.name] = Math.min(Math.max(value, slider.low), slider.high);
      input.setAttribute("aria-valuetext", tell(this.values[slider.name]));
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

  /** Keeps a setting to compare others with; null: the scenario as it is. */
  keep(setting) {
    this.page.kept = setting;
    say(setting ? `Kept: ${setting.label}` : "The kept setting is forgotten.");
    this.finish();
  }

  /** Returns how the present setting is called. */
  label() {
    const changed = Object.entries(this.values).map(([name, value]) => `${name} = ${number(value, 4)}`);
    return [this.name, ...changed].join(", ");
  }

  /** Runs the present setting; while it is computed, only the newest wish is kept. */
  async run() {
    this.wanted = true;
    this.page.editing = true; // a command that ends meanwhile must not put the sliders back
    if (this.busy) return;
    this.busy = true;
    while (this.wanted) {
      this.wanted = false;
      const began = performance.now();
      try {
        this.now = await postPacked("simulate", { ...this.what, values: { ...this.values } });
        this.took.textContent = `${this.now.time.length} rows in ${(performance.now() - began).toFixed(0)} ms`;
        this.finish();
      } catch (error) {
        this.took.textContent = error.message;
      }
    }
    this.busy = false;
  }

  finish() {
    if (this.building) this.building.at = Math.min(this.building.at, this.now.time.length - 1);
    this.forget.disabled = !this.page.kept;
    const same = this.before.outputs === this.now.outputs;
    this.keys.replaceChildren(key(...(same ? [] : [["mark", this.page.kept ? `kept: ${this.before.label}` : this.before.label]]), ["blue", `now: ${this.label()}`]));
    this.draw();
    this.tell();
    this.tellCommands();
    clearTimeout(this.later);
    this.later = setTimeout(() => this.askSpectra(), REST);
  }

  draw() {
    for (const plot of this.plots) plot.later();
  }

  tellCommands() {
    this.page.same(...new Set([this.now.command, this.spectra?.command, this.page.kept?.command].filter(Boolean)));
    this.page.showJobs();
  }

  tell() {
    const change = (before, now) => (before > 0 ? `${now > before ? "+" : ""}${percent(now / before - 1).replace("-", "\u2212")}` : "–");
    const rows = this.now.outputs.map((one) => {
      const before = this.output(this.before, one.name);
      const [factor, unit] = shown(one.unit);
      const sizes = (figure) => [before?.[figure], one[figure]].map((value) => number(factor * value, 4));
      const changed = (figure) => (before ? change(before[figure], one[figure]) : "–");
      return [`${one.name}${unitText(unit)}`, ...sizes("peak"), changed("peak"), ...sizes("rms"), changed("rms")];
    });
    const own = this.page.kept ? "kept" : "before";
    this.figures.replaceChildren(table("Peak and RMS", ["output", `peak, ${own}`, "peak, now", "change", `RMS, ${own}`, "RMS, now", "change"], rows, [1, 2, 3, 4, 5, 6]));
  }
}
