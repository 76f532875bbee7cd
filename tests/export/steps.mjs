// Steps an exported component: node steps.mjs FOLDER PARAMETERS OUTPUT; motion and voltage over time
// as steps.json in the folder; prints the output after each step, or what the component refuses.

import fs from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, parameters, output] = process.argv.slice(2);
const { Component } = await import(pathToFileURL(`${folder}/component.mjs`));
const description = JSON.parse(fs.readFileSync(`${folder}/component.json`, "utf8"));
const component = await Component.load(fs.readFileSync(`${folder}/component.wasm`), description);
const rows = JSON.parse(fs.readFileSync(`${folder}/steps.json`, "utf8"));
const answer = { values: [], error: "" };
try {
  for (let again = 0; again < 2; again++) {
    // A component that was reset gives the same once more.
    answer.values = [];
    component.set(JSON.parse(parameters));
    for (const { dt, ...inputs } of rows) {
      component.set(inputs);
      component.step(dt);
      answer.values.push(component.get(output));
    }
    component.reset();
  }
} catch (error) {
  answer.error = error.message;
}
console.log(JSON.stringify(answer));
