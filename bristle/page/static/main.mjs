// The page: which view is shown, the work that is going on, and what was done.

import { ServerError, get, post } from "./api.mjs";
import { commandLine, h, say, seconds, wrong } from "./dom.mjs";
import { newColours, redraw } from "./plot.mjs";
import { consentPanel } from "./consent.mjs";

const VIEWS = [
  ["data", "Data"],
  ["fit", "Fit"],
  ["errors", "Where it fails"],
  ["verdict", "What is missing"],
  ["history", "Add and compare"],
  ["hand_on", "Export"],
  ["simulate", "Simulate"],
  ["design", "Design"],
  ["controllers", "Compare controllers"],
];
const AT_WORK = ["running", "cancelling"];
const [OFTEN, SELDOM] = [600, 4000]; // ms between two looks: while there is work, else

const part = (id) => document.getElementById(id);

/** What views use of the page. */
class Page {
  constructor() {
    this.study = "";
    this.view = "";
    this.stamp = "";
    this.jobs = [];
    this.lines = new Map(); // of jobs that this page has seen at work
    this.seen = new Map(); // number of a job to its last state
    this.turn = 0;
    this.listeners = new Set();
    window.addEventListener("hashchange", () => this.open());
    part("theme").addEventListener("click", () => this.otherTheme());
    this.setTheme(localStorage.getItem("bristle-theme") ?? this.systemTheme());
    document.addEventListener("visibilitychange", () => document.hidden || this.look());
    this.start();
  }

  async start() {
    try {
      this.home = await get("home");
    } catch (error) {
      return this.fail(error);
    }
    this.jobs = this.home.jobs;
    for (const job of this.jobs) this.seen.set(job.number, job.state);
    const place = location.hash.replace(/^#\/?/, "");
    if (!place && this.home.first) {
      history.replaceState(null, "", `#/${encodeURIComponent(this.home.first)}/data`);
    }
    await this.open();
    this.look();
  }

  /** Opens what the address says: #/ or #/STUDY/VIEW or #/-/simulate without a study. */
  async open() {
    const [study = "", view = ""] = location.hash.replace(/^#\/?/, "").split("/").map(decodeURIComponent);
    const moved = study !== this.study || view !== this.view;
    this.study = study === "-" ? "" : study;
    this.view = view || (this.study ? "data" : "home");
    if (study === "-" && this.view !== "simulate") this.view = "home";
    if (study !== "-" && !this.study) this.view = "home";
    this.listeners.clear();
    this.editing = false;
    this.ended = null;
    this.frame();
    const turn = ++this.turn;
    const target = part("view");
    if (moved) target.replaceChildren(h("p", { class: "loading", role: "status" }, "Loading …"));
    let content;
    try {
      const module = await import(`./views/${this.known(this.view)}.mjs`);
      content = await module.show(this);
    } catch (error) {
      content = this.failure(error);
    }
    if (turn !== this.turn) return; // another view was opened meanwhile
    const top = window.scrollY;
    target.replaceChildren(...[content].flat(Infinity).filter(Boolean));
    if (moved) {
      window.scrollTo(0, 0);
      if (document.activeElement !== document.body && !document.activeElement?.closest("header")) target.focus();
    } else window.scrollTo(0, top);
    this.showJobs();
    document.documentElement.dataset.ready = `${this.study}/${this.view}`;
  }

  known(view) {
    return ["home", "new", ...VIEWS.map(([name]) => name)].includes(view) ? view : "home";
  }

  frame() {
    const title = VIEWS.find(([name]) => name === this.view)?.[1] ?? "";
    document.title = [title, this.study, "bristle"].filter(Boolean).join(" · ");
    part("study").textContent = this.study;
    const steps = part("steps");
    steps.hidden = !this.study && this.view !== "simulate";
    const shown = this.study ? VIEWS : VIEWS.filter(([name]) => name === "simulate");
    steps.replaceChildren(...shown.map(([name, text], k) => {
      const current = name === this.view;
      const link = h("a", { href: this.link(name), "aria-current": current ? "page" : null },
        this.study ? h("span", { "aria-hidden": "true" }, String(k + 1)) : null, text);
      if (current) requestAnimationFrame(() => link.scrollIntoView({ block: "nearest", inline: "nearest" }));
      return link;
    }));
    delete document.documentElement.dataset.ready;
  }

  link(view, study = this.study) {
    return `#/${study ? encodeURIComponent(study) : "-"}/${view}`;
  }

  /** Returns the path of something of the study. */
  path(what) {
    return `studies/${encodeURIComponent(this.study)}/${what}`;
  }

  /** Shows the present view again, with what the study is now. */
  again() {
    return this.open();
  }

  failure(error) {
    if (error instanceof ServerError) {
      if (error.told.kind === "TrustError" && error.told.text) return consentPanel(this, error.told);
      const title = error.status === 401 || error.told.kind === "gone" ? "No connection" : "This cannot be shown";
      return wrong(title, error.message);
    }
    console.error(error);
    return wrong("This cannot be shown", String(error));
  }

  fail(error) {
    part("view").replaceChildren(this.failure(error));
  }

  /** Starts a command of the study. @returns {Promise<object|null>} its job, null where refused */
  async run(what, options = {}, study = this.study) {
    try {
      const job = await post("jobs", { what, study, options });
      this.jobs.push(job);
      this.seen.set(job.number, job.state);
      say(`Started: ${job.command}`);
      this.showJobs();
      this.look();
      return job;
    } catch (error) {
      this.refused = error.message;
      this.showJobs();
      this.look(); // another page may have started what is in the way
      return null;
    }
  }

  /** Returns the job that is at work on the study, if any. */
  working(study = this.study) {
    return this.jobs.find((job) => job.study === study && AT_WORK.includes(job.state));
  }

  /** Calls a function whenever the jobs are known anew, until another view is opened. */
  onJobs(listener) {
    this.listeners.add(listener);
    listener();
  }

  /** Looks at the work that is going on, and again after a while. */
  async look() {
    clearTimeout(this.timer);
    let busy = false;
    try {
      const state = await get(`state?study=${encodeURIComponent(this.study)}`);
      this.jobs = state.jobs;
      let ended = false;
      for (const job of state.jobs) {
        if (job.lines.length) this.lines.set(job.number, job.lines);
        const before = this.seen.get(job.number);
        if (before !== job.state && !AT_WORK.includes(job.state)) {
          if (before !== undefined || job.study === this.study) ended = true;
          say(`${job.command}: ${job.state}.`);
          this.ended?.(job);
        }
        this.seen.set(job.number, job.state);
        busy ||= AT_WORK.includes(job.state);
      }
      const moved = this.stampOf === this.study && this.stamp !== state.stamp;
      [this.stampOf, this.stamp] = [this.study, state.stamp];
      this.showJobs();
      if ((ended || (moved && !busy)) && !this.editing) await this.again();
      this.lost = false;
    } catch (error) {
      if (!this.lost) this.fail(error);
      this.lost = true;
    }
    const pause = busy ? OFTEN : SELDOM;
    if (!document.hidden) this.timer = setTimeout(() => this.look(), pause);
  }

  showJobs() {
    const own = this.jobs.filter((job) => !this.study || job.study === this.study);
    const job = this.working() ?? own.findLast((one) => AT_WORK.includes(one.state)) ?? own.at(-1);
    const wanted = job && job.state !== "done" && job.number !== this.dismissed;
    part("job").hidden = !wanted;
    // A row is made anew for another state alone: a button that is replaced loses the click on it.
    const row = wanted ? `${job.number} ${job.state}` : "";
    if (this.refused) this.showRefused();
    else if (row && row !== this.row) part("job").replaceChildren(...this.jobRow(job));
    else if (row) part("job").querySelector(".now").textContent = this.nowOf(job);
    this.row = this.refused || row;
    this.showCommands(own);
    for (const listener of this.listeners) listener();
  }

  /** Shows why a command was not started, until its user closes it. */
  showRefused() {
    const close = () => {
      this.refused = "";
      this.showJobs();
    };
    if (this.row !== this.refused) {
      part("job").replaceChildren(h("div", { class: "row", role: "alert" },
        h("strong", { class: "level-error" }, "Not started"), h("span", { class: "why" }, this.refused),
        h("button", { type: "button", class: "quiet", onclick: close }, "Close")));
    }
    part("job").hidden = false;
  }

  jobRow(job) {
    const word = { done: "Done", failed: "Failed", cancelled: "Cancelled", cancelling: "Cancelling …" }[job.state];
    const busy = AT_WORK.includes(job.state);
    const close = () => {
      this.dismissed = job.number;
      this.showJobs();
    };
    return [
      h("div", { class: "row" },
        busy ? h("span", { class: "moving", "aria-hidden": "true" }) : null,
        word ? h("strong", { class: job.state === "failed" ? "level-error" : null }, word) : null,
        h("code", {}, job.command),
        h("span", { class: "now" }, this.nowOf(job)),
        busy
          ? h("button", { type: "button", disabled: job.state === "cancelling", onclick: () => this.cancel(job) }, "Cancel")
          : h("button", { type: "button", class: "quiet", onclick: close }, "Close")),
      job.state === "failed" ? h("pre", { class: "pre", tabindex: "0" }, job.error) : null,
    ].filter(Boolean);
  }

  /** Returns what a job is at, or how it ended. */
  nowOf(job) {
    if (AT_WORK.includes(job.state)) return `${seconds(job.seconds)} · ${job.now || "beginning"}`;
    if (job.state === "cancelled") return "What was finished before is in the study.";
    return `after ${seconds(job.seconds)}`;
  }

  async cancel(job) {
    await post(`jobs/${job.number}/cancel`, {});
    this.look();
  }

  showCommands(own) {
    part("did").hidden = !own.length && !this.also?.length;
    const word = { running: "at work", cancelling: "at work" };
    const lines = JSON.stringify([this.also, own.map((job) => [job.command, job.state])]);
    if (lines === this.commandsShown) return;
    this.commandsShown = lines;
    part("commands").replaceChildren(
      h("p", { class: "soft small" }, `In ${this.home?.folder ?? ""}`),
      ...(this.also ?? []).map((text) => commandLine(text)),
      ...own.toReversed().map((job) => commandLine(job.command, word[job.state] ?? job.state)),
    );
  }

  /** Says which commands show the same as the present view. */
  same(...commands) {
    this.also = commands;
  }

  systemTheme() {
    return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  }

  otherTheme() {
    const next = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    localStorage.setItem("bristle-theme", next);
    this.setTheme(next);
  }

  setTheme(theme) {
    document.documentElement.dataset.theme = theme;
    part("theme").textContent = theme === "dark" ? "Light" : "Dark";
    newColours();
    redraw();
  }
}

new Page();
