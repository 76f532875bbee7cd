// The building as it moves: play, a slider of time, and two runs at the same moment.

import { h, number } from "./dom.mjs";
import { Plot, colour } from "./plot.mjs";

/** Returns the levels of the structure, lowest first: level, and the output of its displacement. */
export function levelsOf(names) {
  const found = names.map((name) => /^(\w+)\.(base|floor\d+)_displacement$/.exec(name)).filter(Boolean);
  const order = (level) => (level === "base" ? 0 : Number(level.slice(5)));
  return found.sort((a, b) => order(a[2]) - order(b[2])).map((one) => ({ level: one[2], name: one[0] }));
}

/** A moving picture of a simulation's building; `at` is the row of the present run that is shown. */
export class Building {
  constructor(simulation, levels) {
    Object.assign(this, { simulation, levels, at: 0 });
    this.plot = new Plot("middle", "the building as it moves", (p) => this.draw(p));
    this.scrub = h("input", { type: "range", min: 0, max: 1000, step: "any", value: 0, "aria-label": "time of the picture" });
    this.time = h("output", { class: "soft" }, "0.0 s");
    this.button = h("button", { type: "button", onclick: () => this.play() }, "Play");
    this.playing = false;
    this.scrub.addEventListener("input", () => {
      this.at = Math.round((Number(this.scrub.value) / 1000) * this.last());
      this.show();
    });
    this.node = h("figure", {}, this.plot.canvas, h("div", { class: "play" }, this.button, this.scrub, this.time),
      h("figcaption", {}, "Displacements relative to the ground, enlarged. Grey: the kept setting at the same time."));
  }

  last() {
    return this.simulation.now.time.length - 1;
  }

  show() {
    this.time.textContent = `${this.simulation.now.time[this.at].toFixed(1)} s`;
    this.scrub.value = String((1000 * this.at) / this.last());
    this.scrub.setAttribute("aria-valuetext", this.time.textContent);
    this.simulation.draw();
  }

  play() {
    this.playing = !this.playing;
    this.button.textContent = this.playing ? "Pause" : "Play";
    if (this.at >= this.last()) this.at = 0;
    const { time } = this.simulation.now;
    const [from, began] = [time[this.at], performance.now()];
    const step = () => {
      if (!this.playing || !this.plot.canvas.isConnected) return;
      const wanted = from + (performance.now() - began) / 1000;
      this.at = Math.min(this.last(), Math.round(wanted / (time[1] - time[0])));
      this.show();
      if (this.at < this.last()) requestAnimationFrame(step);
      else this.play();
    };
    if (this.playing) requestAnimationFrame(step);
  }

  draw(p) {
    const c = p.c;
    const [width, height] = p.size;
    const { simulation, levels } = this;
    const seconds = simulation.now.time[Math.min(this.at, this.last())];
    const runs = [[simulation.before, "mark"], [simulation.now, "blue"]]
      .map(([run, name]) => [run, name, levels.map((one) => simulation.output(run, one.name))])
      .filter(([, , outputs]) => outputs.every(Boolean));
    const most = Math.max(1e-9, ...runs.flatMap(([, , outputs]) => outputs.map((one) => one.peak)));
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
    for (const [run, name, outputs] of runs) {
      const at = Math.min(Math.round(seconds / (run.time[1] - run.time[0])), run.time.length - 1);
      const places = levels.map((one, k) => [
        0.5 * width + scale * outputs[k].values[at],
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
