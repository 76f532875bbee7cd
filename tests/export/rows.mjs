// Runs an exported scenario: node rows.mjs FOLDER TIMES CHANGES; seconds of each run as JSON, the
// outputs of the last one as raw floats beside the module.

import fs from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, times, changes] = process.argv.slice(2);
const { Scenario } = await import(pathToFileURL(`${folder}/bristle.mjs`));
const description = JSON.parse(fs.readFileSync(`${folder}/scenario.json`, "utf8"));
const scenario = await Scenario.load(fs.readFileSync(`${folder}/scenario.wasm`), description);
const seconds = [];
let run;
for (let k = 0; k < Number(times); k++) {
  const begin = performance.now();
  run = scenario.run(JSON.parse(changes));
  seconds.push((performance.now() - begin) / 1e3);
}
const columns = description.outputs.map((output) => run.column(output.name));
const bytes = columns.map((one) => Buffer.from(one.buffer, one.byteOffset, one.byteLength));
fs.writeFileSync(`${folder}/rows.bin`, Buffer.concat(bytes));
console.log(JSON.stringify({ seconds, rows: run.rows, complete: run.complete }));
