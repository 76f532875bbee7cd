// Pictures of lines, dots and cells on a canvas, with axes, and stretches that are brushed.

import { number } from "./dom.mjs";
import { decades, marks } from "./scale.mjs";

export { extent } from "./scale.mjs";

const LEFT = 58;
const RIGHT = 12;
const TOP = 8;
const BOTTOM = 36;

let colours = new Map();

/** Forgets the colours: the theme has changed. */
export function newColours() {
  colours = new Map();
}

/** Returns a colour of the page by its name. */
export function colour(name) {
  if (!colours.has(name)) {
    colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  }
  return colours.get(name);
}

/**
 * A picture. `draw(plot)` is called whenever it must be drawn: it sets the ranges by `axes` and then
 * calls `line`, `dots`, `cells` and `band`.
 */
export class Plot {
  /**
   * @param {string} kind class of the canvas: low, middle, high
   * @param {string} label what a reader who does not see it is told
   * @param {(plot: Plot) => void} draw
   */
  constructor(kind, label, draw) {
    this.canvas = document.createElement("canvas");
    this.canvas.className = kind;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    this.drawing = draw;
    this.waiting = false;
    this.size = [0, 0];
    Plot.shown.add(this);
    new ResizeObserver(() => {
      const size = [this.canvas.clientWidth, this.canvas.clientHeight];
      if (size[0] !== this.size[0] || size[1] !== this.size[1]) this.later();
    }).observe(this.canvas);
  }

  /** Draws with the next picture of the screen, however often it is asked. */
  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.now();
    });
  }

  now() {
    const [width, height] = (this.size = [this.canvas.clientWidth, this.canvas.clientHeight]);
    if (!width || !height || !this.canvas.isConnected) return;
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.c = this.canvas.getContext("2d");
    this.c.scale(ratio, ratio);
    this.c.font = '12px "Source Sans 3", "Segoe UI", "Helvetica Neue", Helvetica, Arial, sans-serif';
    this.drawing(this);
  }

  /**
   * Sets the ranges and draws axes with round marks. Ranges and names are those that are read; of an
   * axis that is `logX` or `logY` they are powers of ten, as is what is drawn on it.
   */
  axes([x0, x1], [y0, y1], xName, yName, { logX = false, logY = false } = {}) {
    const [width, height] = this.size;
    Object.assign(this, { x0, x1, y0, y1 });
    this.box = [LEFT, TOP, width - RIGHT, height - (xName === null ? 14 : BOTTOM)];
    const [left, top, right, bottom] = this.box;
    const c = this.c;
    c.save();
    c.fillStyle = colour("soft");
    c.strokeStyle = colour("line");
    c.lineWidth = 1;
    c.textAlign = "center";
    c.textBaseline = "top";
    const ticks = (log, low, high, wanted) => (log ? decades(low, high, wanted) : marks(low, high, wanted));
    for (const x of ticks(logX, x0, x1, Math.max(4, Math.round((right - left) / 90)))) {
      const px = Math.round(this.px(x)) + 0.5;
      c.beginPath();
      c.moveTo(px, top);
      c.lineTo(px, bottom);
      c.stroke();
      if (xName !== null) c.fillText(number(logX ? 10 ** x : x, 6), px, bottom + 4);
    }
    if (xName) c.fillText(xName, 0.5 * (left + right), height - 15);
    c.textAlign = "right";
    c.textBaseline = "middle";
    for (const y of ticks(logY, y0, y1, Math.max(3, Math.round((bottom - top) / 36)))) {
      const py = Math.round(this.py(y)) + 0.5;
      c.beginPath();
      c.moveTo(left, py);
      c.lineTo(right, py);
      c.stroke();
      c.fillText(number(logY ? 10 ** y : y, 4), left - 5, py);
    }
    c.translate(11, 0.5 * (top + bottom));
    c.rotate(-Math.PI / 2);
    c.textAlign = "center";
    c.fillText(yName ?? "", 0, 0, bottom - top + 20);
    c.restore();
  }

  px(x) {
    return this.box[0] + ((x - this.x0) / (this.x1 - this.x0)) * (this.box[2] - this.box[0]);
  }

  py(y) {
    return this.box[3] - ((y - this.y0) / (this.y1 - this.y0)) * (this.box[3] - this.box[1]);
  }

  /** Returns the value at a place on the canvas [CSS pixels]. */
  at(px, py) {
    const [left, top, right, bottom] = this.box;
    return [
      this.x0 + ((px - left) / (right - left)) * (this.x1 - this.x0),
      this.y0 + ((bottom - py) / (bottom - top)) * (this.y1 - this.y0),
    ];
  }

  clipped(act) {
    const [left, top, right, bottom] = this.box;
    this.c.save();
    this.c.beginPath();
    this.c.rect(left, top, right - left, bottom - top);
    this.c.clip();
    act(this.c);
    this.c.restore();
  }

  /** Draws a line through points; fx and fy bring them into the units of the axes. */
  line(x, y, name, { width = 1.2, fx = 1, fy = 1, from = 0, to = x.length, dash = null } = {}) {
    this.clipped((c) => {
      c.strokeStyle = colour(name);
      c.lineWidth = width;
      c.lineJoin = "round";
      if (dash) c.setLineDash(dash);
      c.beginPath();
      const [sx, ox, sy, oy] = this.scales(fx, fy);
      for (let k = from; k < to; k++) c.lineTo(sx * x[k] + ox, sy * y[k] + oy);
      c.stroke();
    });
  }

  /** Draws a line over time: of each column of the screen what is lowest and highest. */
  trace(x, y, name, { fx = 1, fy = 1, ...how } = {}) {
    const wide = Math.max(1, this.box[2] - this.box[0]);
    if (x.length < 4 * wide) {
      this.line(x, y, name, { fx, fy, ...how });
      return;
    }
    const [thinX, thinY] = [[], []];
    const per = x.length / wide;
    for (let column = 0; column < wide; column++) {
      const [from, to] = [Math.floor(column * per), Math.floor((column + 1) * per)];
      let [low, high] = [from, from];
      for (let k = from + 1; k < to; k++) {
        if (y[k] < y[low]) low = k;
        else if (y[k] > y[high]) high = k;
      }
      for (const k of [from, Math.min(low, high), Math.max(low, high)]) {
        thinX.push(x[k]);
        thinY.push(y[k]);
      }
    }
    this.line(thinX, thinY, name, { fx, fy, ...how });
  }

  /**
   * Draws what stays the same as long as size and theme do: once, and from then on as it was.
   * `behind` is drawn before it, each time.
   */
  cached(name, act, behind = null) {
    const { width, height } = this.canvas;
    const own = `${width} ${height} ${document.documentElement.dataset.theme}`;
    if (this.layersOf !== own) this.layers = new Map();
    this.layersOf = own;
    if (!this.layers.has(name)) {
      const layer = new OffscreenCanvas(width, height);
      const shown = this.c;
      this.c = layer.getContext("2d");
      this.c.setTransform(shown.getTransform());
      this.c.font = shown.font;
      act();
      this.c = shown;
      this.layers.set(name, { layer, axes: [this.x0, this.x1, this.y0, this.y1, this.box] });
    }
    const kept = this.layers.get(name);
    [this.x0, this.x1, this.y0, this.y1, this.box] = kept.axes;
    behind?.();
    this.c.save();
    this.c.setTransform(1, 0, 0, 1, 0, 0);
    this.c.drawImage(kept.layer, 0, 0);
    this.c.restore();
  }

  scales(fx, fy) {
    const sx = (this.box[2] - this.box[0]) / (this.x1 - this.x0);
    const sy = (this.box[3] - this.box[1]) / (this.y1 - this.y0);
    return [fx * sx, this.box[0] - this.x0 * sx, -fy * sy, this.box[3] + this.y0 * sy];
  }

  /** Draws dots; `chosen(k)` says which. */
  dots(x, y, name, { size = 1.6, fx = 1, fy = 1, chosen = null, alpha = 1 } = {}) {
    this.clipped((c) => {
      c.fillStyle = typeof name === "string" ? colour(name) : "";
      c.globalAlpha = alpha;
      const [sx, ox, sy, oy] = this.scales(fx, fy);
      const half = size / 2;
      for (let k = 0; k < x.length; k++) {
        if (chosen && !chosen(k)) continue;
        c.fillRect(sx * x[k] + ox - half, sy * y[k] + oy - half, size, size);
      }
    });
  }

  /** Shades x from a to b over the whole height. */
  band(a, b, name, alpha = 1) {
    this.clipped((c) => {
      c.globalAlpha = alpha;
      c.fillStyle = colour(name);
      const left = this.px(a);
      c.fillRect(left, this.box[1], Math.max(1, this.px(b) - left), this.box[3] - this.box[1]);
    });
  }

  /** Shades the room between two curves. */
  between(x, low, high, name, { fx = 1, fy = 1, from = 0, to = x.length } = {}) {
    this.clipped((c) => {
      c.fillStyle = colour(name);
      const [sx, ox, sy, oy] = this.scales(fx, fy);
      c.beginPath();
      for (let k = from; k < to; k++) c.lineTo(sx * x[k] + ox, sy * high(k) + oy);
      for (let k = to - 1; k >= from; k--) c.lineTo(sx * x[k] + ox, sy * low(k) + oy);
      c.fill();
    });
  }
}

/** The plots on the page; those that have left it are dropped. */
Plot.shown = new Set();

/** Draws all plots of the page anew. */
export function redraw() {
  for (const plot of Plot.shown) {
    if (plot.canvas.isConnected) plot.later();
    else Plot.shown.delete(plot);
  }
}
