// Runs a scenario of bristle in a page or in Node: one WebAssembly module, one file of numbers.

const ORDER = [
  "sources", "times", "samples", "dampers", "structures", "sampled", "constants", "memory",
  "signals", "outputs",
];

/** Returns bytes from base64. */
export function bytesOf(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

/** A scenario, ready to run as often as wanted. */
export class Scenario {
  #exports;
  #numbers;
  #base;

  /**
   * @param {BufferSource} wasm the module
   * @param {object} description what `bristle export --web` writes as scenario.json
   */
  static async load(wasm, description) {
    const { instance } = await WebAssembly.instantiate(wasm, {});
    return new Scenario(instance, description);
  }

  constructor(instance, description) {
    this.description = description;
    this.sliders = description.sliders;
    this.#exports = instance.exports;
    this.#exports._initialize?.();
    this.#numbers = bytesOf(description.numbers);
    this.#base = (this.#exports.__heap_base.value + 15) & ~15;
    const rows = description.rows + 1;
    const bytes = this.#numbers.length + 16 * ORDER.length + 8 * rows * description.outputs.length;
    const missing = this.#base + bytes + 256 - this.#exports.memory.buffer.byteLength;
    if (missing > 0) this.#exports.memory.grow(Math.ceil(missing / 65536));
  }

  /**
   * Runs the scenario.
   * @param {Object<string, number>} changes values of sliders by name, in their units
   * @returns {Run}
   */
  run(changes = {}) {
    const { rows, substeps, h, outputs, places } = this.description;
    const memory = this.#exports.memory.buffer;
    new Uint8Array(memory).set(this.#numbers, this.#base);
    const view = new DataView(memory);
    for (const [name, value] of Object.entries(changes)) this.#move(view, name, value);
    const arrays = (this.#base + this.#numbers.length + 15) & ~15;
    ORDER.forEach((name, k) => {
      const [begin, count] = places[name];
      view.setInt32(arrays + 8 * k, this.#base + begin, true);
      view.setInt32(arrays + 8 * k + 4, count, true);
    });
    const found = (arrays + 8 * ORDER.length + 15) & ~15;
    const table = found + 32;
    if (this.#exports.march(rows, substeps, h, arrays, table, found) !== 0) {
      throw new Error("the time loop ended with an error.");
    }
    const filled = Number(view.getBigInt64(found, true));
    const values = new Float64Array(memory, table, filled * outputs.length).slice();
    const step = h * substeps;
    const complete = filled === rows + 1 && view.getBigInt64(found + 8, true) < 0n;
    return new Run(outputs, values, filled, step, complete);
  }

  #move(view, name, value) {
    const slider = this.sliders.find((one) => one.name === name);
    if (slider === undefined) {
      const known = this.sliders.map((one) => one.name).join(", ");
      throw new RangeError(`no slider is named ${name}; there are: ${known}.`);
    }
    if (!(value >= slider.low && value <= slider.high)) {
      throw new RangeError(`${name} = ${value} is not within ${slider.low} to ${slider.high}.`);
    }
    for (const [at, offset, slope] of slider.moved) {
      view.setFloat64(this.#base + at, offset + slope * value, true);
    }
  }
}

/** What a run gave: its outputs row by row. */
export class Run {
  #values;

  constructor(outputs, values, rows, step, complete) {
    this.outputs = outputs;
    this.rows = rows;
    this.step = step;
    this.complete = complete;
    this.#values = values;
  }

  /** Returns the times [s]. */
  get time() {
    return Float64Array.from({ length: this.rows }, (_, k) => k * this.step);
  }

  /** Returns an output as `component.port`, in its unit. */
  column(name) {
    const at = this.outputs.findIndex((one) => one.name === name);
    if (at < 0) throw new RangeError(`no output is named ${name}.`);
    const column = new Float64Array(this.rows);
    for (let k = 0; k < this.rows; k++) column[k] = this.#values[k * this.outputs.length + at];
    return column;
  }

  /** Returns the largest size of an output and its root mean square. */
  figures(name) {
    let peak = 0;
    let total = 0;
    const column = this.column(name);
    for (const value of column) {
      peak = Math.max(peak, Math.abs(value));
      total += value * value;
    }
    return { peak, rms: Math.sqrt(total / column.length) };
  }
}
