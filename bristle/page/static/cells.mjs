// The map of the error: its mean over noise, by displacement and velocity.

import { shown } from "./dom.mjs";
import { colour } from "./plot.mjs";

const CELLS = 13;
const FEWEST = 8; // samples of a cell that is drawn

export const MAP_KEY = [["red", "measured above the model", true], ["blue", "measured below it", true]];

/** The cells of a map: which of them each sample is in, by its displacement and velocity. */
export class Cells {
  constructor(x, v) {
    const edges = (values) => {
      const sorted = Float32Array.from(values).sort();
      const low = sorted[Math.floor(0.004 * (sorted.length - 1))];
      const high = sorted[Math.ceil(0.996 * (sorted.length - 1))];
      return [low, high > low ? high : low + 1];
    };
    this.xEdges = edges(x);
    this.vEdges = edges(v);
    this.cell = new Int16Array(x.length);
    const place = (value, [low, high]) => {
      const k = Math.floor(((value - low) / (high - low)) * CELLS);
      return k < 0 || k >= CELLS ? -1 : k;
    };
    for (let k = 0; k < x.length; k++) {
      const [i, j] = [place(x[k], this.xEdges), place(v[k], this.vEdges)];
      this.cell[k] = i < 0 || j < 0 ? -1 : i * CELLS + j;
    }
  }

  /** Returns the mean error / noise `r` of each cell over the chosen samples, NaN of too few. */
  means(r, chosen = null) {
    const sum = new Float64Array(CELLS * CELLS);
    const count = new Int32Array(CELLS * CELLS);
    for (let k = 0; k < r.length; k++) {
      const cell = this.cell[k];
      if (cell < 0 || (chosen && !chosen[k])) continue;
      sum[cell] += Math.min(30, Math.max(-30, r[k]));
      count[cell]++;
    }
    return sum.map((value, k) => (count[k] >= (chosen ? 1 : FEWEST) ? value / count[k] : NaN));
  }

  /** Returns the mean error / noise that has the full colour. */
  limit(r) {
    const sizes = Array.from(this.means(r)).filter(Number.isFinite).map(Math.abs).sort((a, b) => a - b);
    return Math.max(1, sizes[Math.floor(0.97 * sizes.length)] ?? 1);
  }

  /** Draws the means into a plot, with its axes. */
  draw(p, r, limit, chosen = null) {
    const [[fx, ux], [fv, uv]] = [shown("m"), shown("m/s")];
    const [xs, vs] = [this.xEdges.map((one) => one * fx), this.vEdges.map((one) => one * fv)];
    p.axes(xs, vs, `displacement [${ux}]`, `velocity [${uv}]`);
    const mean = this.means(r, chosen);
    const [blue, red] = [colour("blue"), colour("red")];
    p.clipped((c) => {
      const [w, t] = [(p.box[2] - p.box[0]) / CELLS, (p.box[3] - p.box[1]) / CELLS];
      for (let i = 0; i < CELLS; i++) {
        for (let j = 0; j < CELLS; j++) {
          const value = mean[i * CELLS + j];
          const [left, top] = [p.box[0] + i * w, p.box[3] - (j + 1) * t];
          if (!Number.isFinite(value)) continue;
          c.globalAlpha = 1;
          c.fillStyle = colour("wash");
          c.fillRect(left, top, w - 1, t - 1);
          c.globalAlpha = Math.min(1, Math.abs(value) / limit);
          c.fillStyle = value > 0 ? red : blue;
          c.fillRect(left, top, w - 1, t - 1);
        }
      }
    });
  }
}
