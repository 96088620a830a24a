// The page of a service: jobs with their progress, and a study to submit.

import { ask } from "./ask.js";

const byId = (id) => document.getElementById(id);
const jobs = new Map();
const order = { running: 0, queued: 1 };
let mayChange = false;

/** An element with a text and children. */
function make(tag, text = "", ...children) {
  const element = document.createElement(tag);
  element.textContent = text;
  element.append(...children);
  return element;
}

function say(text) {
  byId("state").textContent = text;
}

// --- the session and its events ---------------------------------------------------------------------------------------

async function start() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  try {
    if (token) {
      history.replaceState(null, "", "/");
      await ask("POST", "/api/session", { token });
    }
    mayChange = (await ask("GET", "/api/session")).right === "full";
  } catch (error) {
    say(error.status === 401 ? "Open the link that the server printed when it started." : error.message);
    return;
  }
  byId("submission").hidden = !mayChange;
  watch();
}

function watch() {
  const source = new EventSource("/api/events");
  const on = (kind, act) => source.addEventListener(kind, (event) => act(JSON.parse(event.data)));
  source.onopen = () => say(mayChange ? "connected" : "connected, to look only");
  source.onerror = () => {
    say("the server does not answer; trying again …");
    if (source.readyState === EventSource.CLOSED) setTimeout(start, 1000);
  };
  on("jobs", (facts) => {
    jobs.clear();
    for (const job of facts.jobs) jobs.set(job.name, job);
    showJobs();
  });
  on("job", (job) => {
    jobs.set(job.name, job);
    showJobs();
  });
  on("deleted", (job) => {
    jobs.delete(job.name);
    showJobs();
  });
}

// --- jobs -------------------------------------------------------------------------------------------------------------

const rows = new Map();

function showJobs() {
  const sorted = [...jobs.values()].sort(compare);
  byId("none").hidden = sorted.length > 0;
  for (const [name, row] of rows) {
    if (!jobs.has(name)) {
      row.remove();
      rows.delete(name);
    }
  }
  sorted.forEach((job, place) => {
    let row = rows.get(job.name);
    if (!row) rows.set(job.name, (row = make("tr")));
    fillRow(row, job);
    const there = byId("jobs").children[place];
    if (there !== row) byId("jobs").insertBefore(row, there ?? null);
  });
}

function compare(a, b) {
  const states = (order[a.state] ?? 2) - (order[b.state] ?? 2);
  if (states) return states;
  if (a.state === "queued") return a.priority - b.priority || a.number - b.number;
  return (b.ended ?? "").localeCompare(a.ended ?? "");
}

function fillRow(row, job) {
  const shape = `${job.state} ${mayChange}`;
  if (row.dataset.shape !== shape) {  // buttons stay the same elements while the numbers change, so focus stays
    row.dataset.shape = shape;
    row.replaceChildren(make("th", job.name), ...Array.from({ length: 6 }, () => make("td")), make("td", "", ...actions(job)));
    row.firstChild.scope = "row";
    row.children[2].append(Object.assign(make("progress"), { max: 1, ariaLabel: `progress of ${job.name}` }));
  }
  const cells = row.children;
  cells[1].textContent = job.reason ? `${job.state}: ${job.reason}` : job.state;
  cells[1].className = job.state === "failed" ? "reason wrong" : job.reason ? "reason" : "";
  cells[2].firstChild.value = job.state === "done" ? 1 : job.designs ? job.done / job.designs : 0;
  const numbers = [
    job.designs ? job.designs.toLocaleString("en") : "",
    job.rate && job.state === "running" ? Math.round(job.rate).toLocaleString("en") : "",
    job.computed ? `${Math.round((100 * job.feasible) / job.computed)} %` : "",
    job.seconds_left === null ? "" : `${Math.ceil(job.seconds_left)} s`,
  ];
  numbers.forEach((text, place) => {
    cells[3 + place].textContent = text;
    cells[3 + place].className = "number";
  });
}

function actions(job) {
  const found = [];
  const add = (label, act) => {
    const button = make("button", label);
    button.type = "button";
    button.ariaLabel = `${label} ${job.name}`;
    button.onclick = () => act().catch((error) => say(error.message));
    found.push(button);
  };
  const path = `/api/jobs/${job.name}`;
  if (job.state === "done") {
    const browse = make("a", "Browse");
    browse.href = `/page/browse.html?results=${job.name}`;
    browse.ariaLabel = `browse the results of ${job.name}`;
    found.push(browse, " ");
    if (mayChange) add("Refine", () => ask("POST", "/api/refinements", { name: newName(`${job.name}-refined`), refine: job.name }));
    const link = make("a", "file");
    link.href = `/api/results/${job.name}/file`;
    link.ariaLabel = `results file of ${job.name}`;
    found.push(link, " ");
  }
  if (!mayChange) return found;
  if (job.state in order) add("Cancel", () => ask("POST", `${path}/cancel`));
  if (job.state === "failed" || job.state === "cancelled") add("Retry", () => ask("POST", `${path}/retry`));
  if (job.state !== "running") {
    add("Delete", async () => {
      if (confirm(`Delete ${job.name} and its results?`)) await ask("DELETE", path);
    });
  }
  return found;
}

/** The name, with a number if a job has it. */
function newName(name) {
  let free = name;
  for (let k = 2; jobs.has(free); k++) free = `${name}-${k}`;
  return free;
}

// --- the editor -------------------------------------------------------------------------------------------------------

function showLines(problems = []) {
  const wrong = new Set(problems.map((problem) => problem.line));
  const count = byId("study").value.split("\n").length;
  const lines = [];
  for (let line = 1; line <= count; line++) {
    const mark = make("span", String(line));
    if (wrong.has(line)) mark.className = "wrong";
    lines.push(mark, "\n");
  }
  byId("lines").replaceChildren(...lines);
  byId("lines").scrollTop = byId("study").scrollTop;
}

function showProblems(problems) {
  showLines(problems);
  byId("problems").replaceChildren(...problems.map((problem) => {
    const button = Object.assign(make("button", problem.text), { type: "button" });
    button.onclick = () => goTo(problem.line ?? 1);
    return make("li", "", button);
  }));
}

function goTo(line) {
  const study = byId("study");
  const lines = study.value.split("\n");
  const first = lines.slice(0, line - 1).join("\n").length + (line > 1);
  study.focus();
  study.setSelectionRange(first, first + (lines[line - 1] ?? "").length);
}

async function submit(query, tell) {
  const text = byId("study").value;
  const shared = { name: byId("name").value, priority: Number(byId("priority").value) };
  const [route, submission] = /^\s*task\s*=/m.test(text)
    ? ["tasks", { ...shared, task: text }]
    : ["studies", { ...shared, study: text, keep: byId("keep").value }];
  byId("outcome").textContent = "…";
  try {
    const facts = await ask("POST", `/api/${route}${query}`, submission);
    showProblems([]);
    byId("outcome").textContent = tell(facts);
  } catch (error) {
    showProblems(error.problems ?? []);
    byId("outcome").textContent = error.problems?.length ? "" : error.message;
  }
}

function tellPlan(plan) {
  if (plan.designs === null) return "a task; how many candidates it has is known when it is done";
  const size = plan.bytes === null ? "the front only" : `${(plan.bytes / 1e6).toLocaleString("en")} MB`;
  const time = plan.seconds === null ? "" : `, about ${Number(plan.seconds.toPrecision(2))} s of computing`;
  return `${plan.designs.toLocaleString("en")} designs, ${plan.columns} columns, ${size}${time}`;
}

byId("form").onsubmit = (event) => {
  event.preventDefault();
  submit("", (job) => `${job.name} is queued`);
};
byId("plan").onclick = () => byId("form").reportValidity() && submit("?dry_run=true", tellPlan);
byId("study").oninput = () => showLines();
byId("study").onscroll = () => (byId("lines").scrollTop = byId("study").scrollTop);
start();
