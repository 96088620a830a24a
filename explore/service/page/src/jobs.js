/** The page of the jobs: the session, the events of all jobs, and what shows them. */

import { ask } from "./ask.js";
import { Editor } from "./editor.js";
import { JobTable } from "./job_table.js";
import { themeButton } from "./themes.js";

const root = (id) => document.getElementById(id);
const say = (text) => (root("state").textContent = text);
const jobs = new Map();
const table = new JobTable(root("jobs"), jobs, say);
const editor = new Editor(root, jobs);
let mayChange = false;

async function start() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  let reason = "Open the link that the server printed when it started, or that somebody made for you.";
  try {
    if (token) {
      history.replaceState(null, "", "/");
      await ask("POST", "/api/session", { token }).catch((error) => {
        if (error.status !== 401) throw error;
        reason = error.message; // unless this browser was let in before
      });
    }
    mayChange = (await ask("GET", "/api/session")).right === "full";
  } catch (error) {
    say(error.status === 401 ? reason : error.message);
    return;
  }
  root("list").hidden = false;
  root("submission").hidden = root("invitation").hidden = !mayChange;
  if (mayChange) editor.offerStarters().catch((error) => say(error.message));
  watch();
}

function watch() {
  const source = new EventSource("/api/events");
  const on = (kind, act) =>
    source.addEventListener(kind, (event) => {
      act(JSON.parse(event.data));
      show();
    });
  source.onopen = () => say(mayChange ? "connected" : "connected, to look only");
  source.onerror = () => {
    say("the server does not answer; trying again …");
    if (source.readyState === EventSource.CLOSED) setTimeout(start, 1000);
  };
  on("jobs", (facts) => {
    jobs.clear();
    for (const job of facts.jobs) jobs.set(job.name, job);
  });
  on("job", (job) => jobs.set(job.name, job));
  on("deleted", (job) => jobs.delete(job.name));
}

function show() {
  root("none").hidden = jobs.size > 0;
  table.show(mayChange);
  editor.offerJobs();
}

root("invite").onsubmit = async (event) => {
  event.preventDefault();
  try {
    const { link } = await ask("POST", "/api/links", { right: root("right").value, name: root("guest").value });
    root("link").hidden = false;
    root("link").value = link;
    root("link").select();
    say("the link opens one browser, once, within a day");
  } catch (error) {
    say(error.message);
  }
};
themeButton(root("theme"));
start();
