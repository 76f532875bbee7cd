// Runs a scenario: in the page by its WebAssembly module, or by the coupled engine of the server.

import { postPacked, raw } from "./api.mjs";
import { Scenario } from "./bristle.mjs";

let module = null; // promise of the bytes of the module: one serves all scenarios

/** A scenario of the page, ready to run with other values; `what` names it as the server does. */
export class Engine {
  /** @param {object} what @param {object} first the server's answer about it */
  constructor(what, first) {
    this.what = what;
    this.first = first;
    this.scenario = null;
    this.why = "The engine is being compiled for this page. Until then the server computes the runs.";
  }

  /** Gets what the page needs to run it itself; where that cannot be had, the server goes on. */
  async prepare() {
    try {
      module ??= raw("module");
      const [wasm, description] = await Promise.all([module, postPacked("numbers", this.what)]);
      this.scenario = await Scenario.load(wasm, description);
      this.movable = new Set(this.scenario.sliders.map((one) => one.name));
      this.why = "";
    } catch (error) {
      module = null;
      this.why = `The server computes: ${error.message}`;
    }
  }

  /** Returns whether the page itself can run it with these values. */
  runsHere(values) {
    return this.scenario !== null && Object.keys(values).every((name) => this.movable.has(name));
  }

  /** @param {Object<string, number>} values of parameters by name @returns {Promise<object>} */
  async run(values) {
    if (!this.runsHere(values)) return postPacked("simulate", { ...this.what, values });
    const run = this.scenario.run(values);
    if (!run.complete) {
      throw new Error("The run stopped early: a value was not finite, or force and motion did not agree.");
    }
    const every = Math.ceil(run.rows / this.first.rows);
    const thinned = (column) => (every === 1 ? column : column.filter((_, k) => k % every === 0));
    return {
      time: thinned(run.time),
      every,
      command: this.command(values),
      outputs: run.outputs.map(({ name, unit }) => {
        const column = run.column(name);
        return { name, unit, values: thinned(column), ...run.figures(name) };
      }),
    };
  }

  /** Returns the command that makes the same run. */
  command(values) {
    const sets = Object.entries(values).map(([name, value]) => ` --set ${quoted(`${name}=${value}`)}`);
    return this.first.command + sets.join("");
  }
}

/** Returns a word as a shell takes it. */
function quoted(word) {
  return /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\"'\"'")}'`;
}
