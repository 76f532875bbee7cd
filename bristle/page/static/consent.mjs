// A study's own effect or law: its text is shown, and runs once its user has consented to it.

import { get, post } from "./api.mjs";
import { h } from "./dom.mjs";

/** Returns what asks for consent to the texts of a study that have not run on this machine. */
export function consentPanel(page, told) {
  const list = h("div", {}, h("p", { class: "loading" }, "Loading …"));
  get(page.path("consent")).then(
    ({ texts }) => list.replaceChildren(...texts.map((one) => asked(page, one))),
    (error) => list.replaceChildren(h("p", {}, error.message)),
  );
  return h("div", { class: "state" },
    h("h2", {}, "This study holds code that has not run on this machine"),
    h("p", {}, "An effect or a law is Python, and it runs with your rights. Read it. It runs here, and in the ",
      "commands, once you have consented to this text; a text that changes asks again."),
    told.error ? h("p", { class: "soft small" }, told.error) : null,
    list);
}

function asked(page, one) {
  const button = h("button", { type: "button", class: "main" }, "Run this text from now on");
  const trouble = h("p", { role: "alert" });
  button.addEventListener("click", async () => {
    button.disabled = true;
    try {
      await post(page.path("consent"), { file: one.file, digest: one.digest });
      await page.again();
    } catch (error) {
      trouble.textContent = error.message;
    }
  });
  return h("section", {}, h("h3", {}, one.file), h("pre", { tabindex: "0" }, one.text), h("div", { class: "act" }, button), trouble);
}
