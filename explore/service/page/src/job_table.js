/** The table of jobs: a row for each, whose buttons stay the same elements while its numbers change. */

import { el } from "../../../figures/reporting/page/src/dom.js";
import { ask } from "./ask.js";
import { freeName } from "./names.js";

/** Place of the owner and the date among the figures. */
const SUBMITTED = 4;
const FIRST = { running: 0, queued: 1 };
const COLUMNS = ["state", "progress", "designs", "designs/s", "feasible", "time left", "submitted"];

export class JobTable {
  /**
   * @param {HTMLElement} body of the table
   * @param {Map<string, Object>} jobs by name
   * @param {(text: string) => void} say
   */
  constructor(body, jobs, say) {
    Object.assign(this, { body, jobs, say, rows: new Map() });
  }

  show(mayChange) {
    const focused = document.activeElement,
      row = this.body.contains(focused) ? focused.closest("tr") : null;
    this.update(mayChange);
    // What was moved or replaced lost the focus, and the keyboard its place.
    if (row && focused !== document.activeElement) {
      const next = focused.isConnected ? focused : row.isConnected ? row.querySelector("a, button, input") : null;
      (next ?? this.body.closest("[tabindex]")).focus();
    }
  }

  update(mayChange) {
    for (const [name, row] of this.rows) {
      if (!this.jobs.has(name)) {
        row.remove();
        this.rows.delete(name);
      }
    }
    [...this.jobs.values()].sort(compare).forEach((job, place) => {
      let row = this.rows.get(job.name);
      if (!row) this.rows.set(job.name, (row = el("tr", { role: "row" })));
      this.fill(row, job, mayChange);
      const there = this.body.children[place];
      if (there !== row) this.body.insertBefore(row, there ?? null);
    });
  }

  fill(row, job, mayChange) {
    const shape = `${job.state} ${mayChange} ${hasDesigns(job)}`;
    if (row.dataset.shape !== shape) {
      row.dataset.shape = shape;
      row.replaceChildren(
        el("th", { scope: "row", role: "rowheader" }, job.name, ...remarksOf(job)),
        ...COLUMNS.map((name) => el("td", { role: "cell", "data-label": name })),
        el("td", { role: "cell" }, ...this.actions(job, mayChange)),
      );
      row.children[2].append(el("progress", { max: 1, "aria-label": `progress of ${job.name}` }));
    }
    const [, state, progress, ...numbers] = row.children;
    state.textContent = job.reason ? `${job.state}: ${job.reason}` : job.state;
    state.className = job.state === "failed" ? "reason wrong" : job.reason ? "reason" : "";
    showProgress(progress.firstChild, job);
    figures(job).forEach((text, place) => {
      numbers[place].textContent = text;
      if (place < SUBMITTED) numbers[place].className = "number";
    });
    const priority = row.querySelector("input");
    if (priority && document.activeElement !== priority) priority.value = job.priority;
  }

  actions(job, mayChange) {
    const path = `/api/jobs/${job.name}`;
    const link = (text, href, what) => el("a", { href, "aria-label": `${what} of ${job.name}` }, text);
    const button = (text, act) =>
      el("button", { type: "button", "aria-label": `${text} ${job.name}`, onclick: () => act().catch((error) => this.say(error.message)) }, text);
    const post = (route, content) => () => ask("POST", route, content);
    const found = [];
    if (hasDesigns(job)) found.push(link("Browse", `/page/browse.html?results=${job.name}`, "browse the results"));
    if (job.state === "done") {
      if (mayChange) found.push(button("Refine", () => this.refine(job)));
      found.push(link("file", `/api/results/${job.name}/file`, "results file"));
    }
    if (!mayChange) return found;
    if (job.state === "queued") found.push(this.priority(job, path));
    if (job.state in FIRST) found.push(button("Cancel", post(`${path}/cancel`)));
    if (job.state === "failed" || job.state === "cancelled") found.push(button("Retry", post(`${path}/retry`)));
    if (job.state !== "running") {
      found.push(button("Delete", async () => {
        if (confirm(`Delete ${job.name} and its results?`)) await ask("DELETE", path);
      }));
    }
    return found;
  }

  async refine(job) {
    const name = freeName(`${job.name.slice(0, 56)}-refined`, this.jobs);
    this.say(`ranking ${job.name} to refine it …`); // which takes seconds for a large file
    await ask("POST", "/api/refinements", { name, refine: job.name });
    this.say(`${name} is queued`);
  }

  /** A field for the priority of a job that waits. */
  priority(job, path) {
    const input = el("input", { type: "number", min: 1, max: 9, value: job.priority, title: "1 runs first, 9 last", "aria-label": `priority of ${job.name}` });
    input.onchange = () => {
      if (input.value && input.reportValidity()) ask("POST", `${path}/priority`, { priority: Number(input.value) }).catch((error) => this.say(error.message));
    };
    return el("label", { class: "priority" }, "priority ", input);
  }
}

/** What may not be meant in the file of a job. */
const remarksOf = ({ remarks }) =>
  remarks.length ? [el("details", { class: "remarks" }, el("summary", {}, remarks.length === 1 ? "1 remark" : `${remarks.length} remarks`), el("ul", {}, ...remarks.map((text) => el("li", {}, text))))] : [];

/** Whether results can be browsed: those of a job that was cancelled or failed have the designs that were computed. */
const hasDesigns = ({ state, done }) => state === "done" || (!(state in FIRST) && done > 0);

/** The running job first, then those that wait in their order, then the others, the last to end first. */
function compare(a, b) {
  const states = (FIRST[a.state] ?? 2) - (FIRST[b.state] ?? 2);
  if (states) return states;
  if (a.state === "queued") return a.priority - b.priority || a.number - b.number;
  return b.ended_number - a.ended_number || (b.ended ?? "").localeCompare(a.ended ?? "");
}

/** The share that is done; how far a search is that has not told its steps is not known. */
function showProgress(bar, job) {
  const isSearch = job.kind === "task" && !job.designs;
  if (job.state === "running" && isSearch && !job.steps) bar.removeAttribute("value");
  else bar.value = job.state === "done" ? 1 : isSearch ? job.steps_done / (job.steps || 1) : job.designs ? job.done / job.designs : 0;
}

function figures(job) {
  const isSearch = job.kind === "task" && !job.designs;
  return [
    isSearch ? "known when found" : job.designs ? job.designs.toLocaleString("en") : "",
    job.rate && job.state === "running" ? Math.round(job.rate).toLocaleString("en") : "",
    job.computed ? percent(job.feasible / job.computed) : job.kind === "task" && job.designs ? percent(job.feasible / job.designs) : "",
    job.seconds_left !== null ? duration(job.seconds_left) : isSearch && job.state === "running" ? "not known" : "",
    [job.submitted ? new Date(job.submitted).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" }) : "", job.owner].filter(Boolean).join(", "),
  ];
}

/** Two digits, so that few feasible designs are not none. */
function percent(share) {
  return `${Number((100 * share).toPrecision(2))} %`;
}

function duration(seconds) {
  if (seconds < 90) return `${Math.ceil(seconds)} s`;
  return seconds < 5400 ? `${Math.ceil(seconds / 60)} min` : `${(seconds / 3600).toFixed(1)} h`;
}
