/** The editor of a study or a task: starters and earlier jobs to begin from, mistakes at their lines, dry runs. */

import { el } from "../../../figures/reporting/page/src/dom.js";
import { raised } from "../../../figures/reporting/page/src/format.js";
import { ask, askText } from "./ask.js";
import { freeName } from "./names.js";

export class Editor {
  /**
   * @param {(id: string) => HTMLElement} root
   * @param {Map<string, Object>} jobs by name
   */
  constructor(root, jobs) {
    Object.assign(this, { root, jobs, loaded: "", suggested: "", offered: "", listed: "", asked: 0, isSubmitting: false });
    this.study = root("study");
    root("form").onsubmit = (event) => {
      event.preventDefault();
      this.submit("", "submitting …", (job) => `${job.name} is queued`);
    };
    root("plan").onclick = () =>
      root("form").reportValidity() &&
      this.submit("?dry_run=true", "measuring a design …", tellPlan);
    root("start").onchange = () => this.startFrom(root("start").value).catch((error) => this.tell(error.message));
    this.study.oninput = () => {
      root("start").value = "";
      this.changed();
    };
    this.study.onscroll = () => (root("lines").scrollTop = this.study.scrollTop);
  }

  tell(text) {
    this.root("outcome").textContent = text;
  }

  // --- where to start from ----------------------------------------------------------------------------------------------

  /** Offer the studies and tasks that `explore init` writes. */
  async offerStarters() {
    const starters = await ask("GET", "/api/starters");
    for (const [kind, list] of Object.entries(starters)) {
      const options = list.map(({ name, summary }) => el("option", { value: `starters/${kind}/${name}`, title: summary }, name));
      this.root(`start-${kind}`).replaceChildren(...options);
    }
  }

  /** Offer what was submitted before. */
  offerJobs() {
    const names = [...this.jobs.values()].filter(({ kind }) => kind !== "refinement").map(({ name }) => name);
    if (this.offered === names.join()) return;
    this.offered = names.join();
    this.root("start-jobs").replaceChildren(...names.map((name) => el("option", { value: `jobs/${name}/study` }, name)));
  }

  /** Put a text into the editor; the focus stays in the list, where each arrow key chooses the next one. */
  async startFrom(path) {
    const { study, root } = this;
    if (!path) return;
    if (study.value.trim() && study.value !== this.loaded && !confirm("Replace the text in the editor?")) {
      root("start").value = "";
      return;
    }
    const text = await askText(`/api/${path}`);
    if (root("start").value !== path) return; // another one was chosen since
    study.value = this.loaded = text;
    const [kind, name, last] = path.split("/");
    if (!root("name").value || root("name").value === this.suggested)
      root("name").value = this.suggested = freeName(kind === "jobs" ? name : last, this.jobs);
    this.tell("");
    this.showProblems([]);
    this.changed();
    study.setSelectionRange(0, 0);
    study.scrollTop = 0;
  }

  get isTask() {
    return /^\s*task\s*=/m.test(this.study.value);
  }

  changed() {
    this.showLines();
    this.root("keep").parentElement.hidden = this.isTask; // a task keeps all its linkages
    this.listMetrics(/^\s*mechanism\s*=\s*["']([\w-]+)["']/m.exec(this.study.value)?.[1] ?? "").catch(() => (this.root("metrics").hidden = true));
  }

  /** The metrics of the mechanism of the text, with their meanings. */
  async listMetrics(mechanism) {
    const { root } = this;
    if (mechanism === this.listed) return;
    this.listed = mechanism;
    root("metrics").hidden = !mechanism;
    if (!mechanism) return;
    const { metrics, signals, statistics } = await ask("GET", `/api/starters/studies/${mechanism}/metrics`);
    if (mechanism !== this.listed) return;
    const row = ({ name, unit, meaning }) => el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, raised(unit)), el("td", { class: "reason" }, meaning));
    const part = (title) => el("tr", {}, el("th", { scope: "rowgroup", colspan: 3 }, title));
    root("metrics").firstElementChild.textContent = `Metrics of ${mechanism}`;
    root("metric-list").replaceChildren(part("metrics"), ...metrics.map(row), part("signals"), ...signals.map(row));
    root("statistics").textContent = `Of each signal there are metrics SIGNAL_STATISTIC; STATISTIC is ${statistics.join(", ")}.`;
  }

  // --- mistakes ---------------------------------------------------------------------------------------------------------

  showLines(problems = []) {
    const wrong = new Set(problems.map((problem) => problem.line));
    const count = this.study.value.split("\n").length;
    const lines = Array.from({ length: count }, (_, k) => el("span", { class: wrong.has(k + 1) ? "wrong" : false }, k + 1));
    this.root("lines").replaceChildren(...lines.flatMap((line) => [line, "\n"]));
    this.root("lines").scrollTop = this.study.scrollTop;
  }

  showProblems(problems) {
    this.showLines(problems);
    const line = (problem) => el("button", { type: "button", onclick: () => this.goTo(problem.line ?? 1) }, problem.text);
    this.root("problems").replaceChildren(...problems.map((problem) => el("li", {}, line(problem))));
  }

  /** What may not be meant, each with its line, which is not marked as wrong. */
  showRemarks(remarks) {
    this.showProblems(remarks.map((text) => ({ text: `perhaps not meant: ${text}`, line: Number(/:(\d+):/.exec(text)?.[1] ?? 1) })));
    this.showLines();
  }

  goTo(line) {
    const lines = this.study.value.split("\n");
    const first = lines.slice(0, line - 1).join("\n").length + (line > 1);
    this.study.focus();
    this.study.setSelectionRange(first, first + (lines[line - 1] ?? "").length);
  }

  // --- what is sent -----------------------------------------------------------------------------------------------------

  /** Send the text; a submission does not wait for a dry run, whose answer is then of no interest any more. */
  async submit(query, patience, tell) {
    if (this.isSubmitting) return this.tell("the submission before is not answered yet; try again when it is");
    const { root } = this,
      mine = ++this.asked;
    const shared = { name: root("name").value, priority: Number(root("priority").value) };
    const [route, content] = this.isTask
      ? ["tasks", { ...shared, task: this.study.value }]
      : ["studies", { ...shared, study: this.study.value, keep: root("keep").value }];
    this.tell(patience);
    this.isSubmitting = !query;
    try {
      const facts = await ask("POST", `/api/${route}${query}`, content);
      if (mine !== this.asked) return;
      this.showRemarks(facts.remarks);
      this.tell(tell(facts));
    } catch (error) {
      if (mine !== this.asked) return;
      this.showProblems(error.problems ?? []);
      this.tell(error.problems?.length ? "" : error.message);
    } finally {
      if (!query) this.isSubmitting = false;
    }
  }
}

function tellPlan(plan) {
  if (plan.designs === null) return "a task; how many linkages it finds, and how long that takes, is known when it is done";
  const size = plan.bytes === null ? "the front only" : `${(plan.bytes / 1e6).toLocaleString("en")} MB`;
  const time = plan.seconds === null ? (plan.note ? `; ${plan.note}` : "") : `, about ${Number(plan.seconds.toPrecision(2))} s of computing`;
  return `${plan.designs.toLocaleString("en")} designs, ${plan.columns} columns, ${size}${time}`;
}
