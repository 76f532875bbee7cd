// Runs a component of bristle in a page or in Node: the functions of its FMU, one step at a time.

const KINDS = { Real: 8, Integer: 4, Boolean: 4 };
const FAILED = 2; // the first status of FMI that is no success

/** A component, from its start on. */
export class Component {
  #exports;
  #instance;
  #places;
  #variables;
  #said = [];
  #stepping = false;

  /**
   * @param {BufferSource} wasm the module
   * @param {object} description what `bristle export --web` writes as component.json
   */
  static async load(wasm, description) {
    const component = new Component();
    const refused = () => 8; // WASI's "bad file descriptor": a page has no files
    const imports = {
      wasi_snapshot_preview1: new Proxy({}, { get: () => refused }),
      bristle: { log: (status, at) => component.#log(status, at) },
    };
    const { instance } = await WebAssembly.instantiate(wasm, imports);
    component.#begin(instance.exports, description);
    return component;
  }

  #begin(exports, description) {
    exports._initialize?.();
    this.#exports = exports;
    this.description = description;
    this.time = 0;
    this.#variables = new Map(description.variables.map((one) => [one.name, one]));
    this.#places = exports.malloc(16);
    const [name, guid] = [this.#text(description.name), this.#text(description.guid)];
    this.#instance = exports.instantiate(name, guid);
    for (const at of [name, guid]) exports.free(at);
    if (this.#instance === 0) throw new Error(this.#why("the module and its description differ"));
  }

  /** Sets inputs, or before the first step parameters, by name. */
  set(values) {
    for (const [name, value] of Object.entries(values)) {
      const { kind, reference } = this.#variable(name);
      const text = kind === "String" ? this.#text(String(value)) : 0;
      // Only now: memory that grows for a long text takes its views away.
      const view = new DataView(this.#exports.memory.buffer);
      view.setUint32(this.#places, reference, true);
      if (kind === "String") {
        view.setUint32(this.#places + 8, text, true);
        const status = this.#call("Set", kind);
        this.#exports.free(text);
        this.#done(status);
        continue;
      }
      if (kind === "Real") view.setFloat64(this.#places + 8, value, true);
      else view.setInt32(this.#places + 8, Number(value), true);
      this.#done(this.#call("Set", kind));
    }
  }

  /** Returns the value of a variable by name, in its unit. */
  get(name) {
    const { kind, reference, causality } = this.#variable(name);
    // Parameters that are read can still be set: the start alone fixes them.
    if (!this.#stepping && causality === "output") this.#start();
    if (!(kind in KINDS)) throw new TypeError(`${name} is a text, which is only set.`);
    const view = new DataView(this.#exports.memory.buffer);
    view.setUint32(this.#places, reference, true);
    this.#done(this.#call("Get", kind));
    const after = new DataView(this.#exports.memory.buffer);
    if (kind === "Real") return after.getFloat64(this.#places + 8, true);
    const value = after.getInt32(this.#places + 8, true);
    return kind === "Boolean" ? value !== 0 : value;
  }

  /** Steps over `dt` seconds. */
  step(dt) {
    if (!this.#stepping) this.#start();
    this.#done(this.#exports.fmi2DoStep(this.#instance, this.time, dt, 1));
    this.time += dt;
  }

  /** Goes back to the start, all values as the component declares them. */
  reset() {
    this.#done(this.#exports.fmi2Reset(this.#instance));
    this.time = 0;
    this.#stepping = false;
  }

  #start() {
    const { fmi2SetupExperiment, fmi2EnterInitializationMode, fmi2ExitInitializationMode } =
      this.#exports;
    this.#done(fmi2SetupExperiment(this.#instance, 0, 0, 0, 0, 0));
    this.#done(fmi2EnterInitializationMode(this.#instance));
    this.#done(fmi2ExitInitializationMode(this.#instance));
    this.#stepping = true;
  }

  #call(verb, kind) {
    const call = this.#exports[`fmi2${verb}${kind}`];
    return call(this.#instance, this.#places, 1, this.#places + 8);
  }

  #variable(name) {
    const found = this.#variables.get(name);
    if (found === undefined) throw new RangeError(`no variable is named ${name}.`);
    return found;
  }

  #text(value) {
    const bytes = new TextEncoder().encode(`${value}\0`);
    const at = this.#exports.malloc(bytes.length);
    new Uint8Array(this.#exports.memory.buffer).set(bytes, at);
    return at;
  }

  #log(status, at) {
    const memory = new Uint8Array(this.#exports.memory.buffer);
    const text = new TextDecoder().decode(memory.subarray(at, memory.indexOf(0, at)));
    this.#said.push(text.replaceAll("%%", "%"));
  }

  #done(status) {
    if (status >= FAILED) throw new Error(this.#why(`status ${status}`));
  }

  #why(otherwise) {
    return this.#said.at(-1) ?? otherwise;
  }

  /** What the component has said so far: warnings, and why it stopped. */
  get messages() {
    return [...this.#said];
  }
}
