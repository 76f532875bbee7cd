// Pictures of the same samples: what is chosen in one, all show.

import { brush } from "./brush.mjs";
import { Cells, MAP_KEY } from "./cells.mjs";
import { h, key, number, say, shown, z } from "./dom.mjs";
import { Plot, extent } from "./plot.mjs";

/** The samples of all runs in one row, what is chosen of them, and the pictures that show it. */
export class Linked {
  constructor(found) {
    this.found = found;
    const runs = found.runs;
    this.runs = runs;
    const count = runs.reduce((sum, run) => sum + run.time.length, 0);
    const joined = (name) => {
      if (!runs.every((run) => run[name])) return null;
      const whole = new Float32Array(count);
      let at = 0;
      for (const run of runs) {
        whole.set(run[name], at);
        at += run[name].length;
      }
      return whole;
    };
    this.x = joined("displacement");
    this.v = joined("velocity");
    this.measured = joined("measured");
    this.predicted = joined("predicted");
    this.r = joined("normalised");
    this.count = count;
    this.chosen = null; // Uint8Array (count), or null for all
    this.starts = [];
    let at = 0;
    for (const run of runs) {
      this.starts.push(at);
      at += run.time.length;
    }
    this.run = runs.reduce((best, run, k) => (run.z > runs[best].z ? k : best), 0);
    this.part = null; // seconds of the run, where a stretch of time is chosen
    this.makeMap();
    this.makePlots();
  }

  makeMap() {
    if (!this.x || !this.v) return;
    this.cells = new Cells(this.x, this.v);
    this.limit = this.cells.limit(this.r);
  }

  makePlots() {
    const { found } = this;
    const [fx, ux] = shown("m");
    const [fv, uv] = shown("m/s");
    const force = `${found.quantity} [${found.unit}]`;
    const own = () => this.runs[this.run];
    const shade = (p) => () => this.part && p.band(this.part[0], this.part[1], "shade");
    this.time = new Plot("", "force over time, measured and predicted", (p) => {
      const run = own();
      p.cached(`time ${this.run}`, () => {
        p.axes([run.time[0], run.time.at(-1)], extent([run.measured, run.predicted]), null, force);
        p.trace(run.time, run.measured, "mark", { width: 1.6 });
        p.trace(run.time, run.predicted, "blue", { width: 1.1 });
      }, shade(p));
    });
    this.error = new Plot("middle", "error over time, with twice the expected noise", (p) => {
      const run = own();
      const error = this.errorOf(this.run);
      p.cached(`error ${this.run}`, () => {
        const size = Math.max(...extent([error]).map(Math.abs), 2 * run.noise);
        p.axes([run.time[0], run.time.at(-1)], [-size, size], "time [s]", `error [${found.unit}]`);
        p.between(run.time, (k) => -2 * run.sigma[k], (k) => 2 * run.sigma[k], "floor");
        p.trace(run.time, error, "red", { width: 0.9 });
      }, shade(p));
      const begin = this.starts[this.run];
      if (this.chosen && !this.part) {
        p.dots(run.time, error, "ink", { size: 2.4, chosen: (k) => this.chosen[begin + k] });
      }
    });
    this.plots = [this.time, this.error];
    const loop = (values, factor, name, unit) => new Plot("high", `force over ${name}, measured and predicted`, (p) => {
      const axes = () => p.axes(extent([values], 0.04, factor), extent([this.measured], 0.04), `${name} [${unit}]`, force);
      if (!this.chosen) {
        p.cached("all", () => {
          axes();
          p.dots(values, this.measured, "mark", { fx: factor, size: 1.5 });
          p.dots(values, this.predicted, "blue", { fx: factor, size: 1.1 });
        });
        return;
      }
      p.cached("behind", () => {
        axes();
        p.dots(values, this.measured, "pale", { fx: factor, size: 1.2 });
      });
      const chosen = (k) => this.chosen[k];
      p.dots(values, this.measured, "ink", { fx: factor, size: 2.2, chosen });
      p.dots(values, this.predicted, "blue", { fx: factor, size: 1.8, chosen });
    });
    for (const plot of [this.time, this.error]) brush(plot, (part) => this.chooseTime(part));
    if (this.x) {
      this.overX = loop(this.x, fx, "displacement", ux);
      brush(this.overX, (part) => this.chooseBox(this.x, fx, part), { both: true });
      this.plots.push(this.overX);
    }
    if (this.v) {
      this.overV = loop(this.v, fv, "velocity", uv);
      brush(this.overV, (part) => this.chooseBox(this.v, fv, part), { both: true });
      this.plots.push(this.overV);
    }
    if (this.cells) {
      this.map = new Plot("high", "mean error over noise, by displacement and velocity", (p) => this.cells.draw(p, this.r, this.limit, this.chosen));
      brush(this.map, (part) => this.chooseCells(part, fx, fv), { both: true });
      this.plots.push(this.map);
    }
  }

  /** Returns the error of a run, 0 where nothing was measured. */
  errorOf(number) {
    const run = this.runs[number];
    run.error ??= run.measured.map((value, k) => (run.known && !run.known[k] ? 0 : value - run.predicted[k]));
    return run.error;
  }

  chooseTime(part) {
    const run = this.runs[this.run];
    this.part = part && [part[0][0], part[0][1]];
    this.choose(part && ((k) => {
      const own = k - this.starts[this.run];
      return own >= 0 && own < run.time.length && run.time[own] >= part[0][0] && run.time[own] <= part[0][1];
    }));
  }

  chooseBox(values, factor, part) {
    this.part = null;
    this.choose(part && ((k) => {
      const x = values[k] * factor;
      const y = this.measured[k];
      return x >= part[0][0] && x <= part[0][1] && y >= part[1][0] && y <= part[1][1];
    }));
  }

  chooseCells(part, fx, fv) {
    this.part = null;
    this.choose(part && ((k) => {
      const [x, v] = [this.x[k] * fx, this.v[k] * fv];
      return x >= part[0][0] && x <= part[0][1] && v >= part[1][0] && v <= part[1][1];
    }));
  }

  /** Chooses samples and shows them in all pictures. */
  choose(which) {
    if (which === null) this.chosen = null;
    else {
      this.chosen ??= new Uint8Array(this.count);
      for (let k = 0; k < this.count; k++) this.chosen[k] = which(k) ? 1 : 0;
    }
    for (const plot of this.plots) plot.later();
    this.tell();
  }

  /** Says how large the error is among the chosen samples. */
  tell() {
    let [count, squares] = [0, 0];
    for (let k = 0; k < this.count; k++) {
      if (this.chosen && !this.chosen[k]) continue;
      count++;
      squares += this.r[k] ** 2;
    }
    this.clear.disabled = !this.chosen;
    const seconds = count * this.runs[0].dt;
    this.text.textContent = this.chosen
      ? `Chosen: ${count} samples, ${number(seconds)} s; RMS of error / noise there ${count ? z(Math.sqrt(squares / count)) : "–"}.`
      : "Choose a stretch of time, a part of a loop or of the map: the others show it.";
  }

  nodes() {
    const select = h("select", { id: "stretch-run" }, this.runs.map((run, k) =>
      h("option", { value: k, selected: k === this.run }, `${run.name}, z = ${z(run.z)}`)));
    select.addEventListener("change", () => {
      this.run = Number(select.value);
      this.part = null;
      this.choose(null);
    });
    this.text = h("span", { class: "soft", role: "status" });
    this.clear = h("button", { type: "button", class: "quiet", onclick: () => {
      this.part = null;
      this.choose(null);
      say("Nothing is chosen.");
    } }, "Choose nothing");
    this.tell();
    return h("section", { "aria-label": "Linked pictures" },
      h("div", { class: "act" }, h("label", { class: "field", for: "stretch-run" }, "Run over time", select), this.clear, this.text),
      h("figure", {}, this.time.canvas, this.error.canvas),
      key(["mark", "measured"], ["blue", "model"], ["red", "error"], ["floor", "twice the expected noise", true]),
      h("div", { class: "grid", style: { "margin-top": "1.4rem" } },
        [[this.overX, "Force over displacement, all runs"], [this.overV, "Force over velocity, all runs"]]
          .filter(([plot]) => plot).map(([plot, title]) => h("figure", {}, h("h3", {}, title), plot.canvas)),
        this.map ? h("figure", {}, h("h3", {}, "Mean error / noise by displacement and velocity"), this.map.canvas,
          key(...MAP_KEY)) : null));
  }
}
