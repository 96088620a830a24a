/** The results browser: whole files are counted by the service; all views share one set of conditions. */

import { onTheme } from "../../../figures/reporting/page/src/theme.js";
import { el } from "../../../figures/reporting/page/src/dom.js";
import { countOf } from "../../../figures/reporting/page/src/format.js";
import { FRONT } from "../../../figures/reporting/page/src/payload.js";
import { ask } from "./ask.js";
import { cloud } from "./cloud.js";
import { Conditions } from "./conditions.js";
import { designs } from "./designs.js";
import { histograms } from "./histograms.js";
import { latest } from "./latest.js";
import { ranking } from "./ranking.js";
import { addressOf, browsingOf, waitForIndexes } from "./sources.js";
import { summary } from "./summary.js";
import { themeButton } from "./themes.js";

/** Milliseconds without a change of the conditions before the results are ranked again. */
const PAUSE = 500;

const root = (id) => document.getElementById(id);
const say = (text) => {
  root("notice").hidden = !text;
  root("notice").textContent = text;
};

async function start() {
  themeButton(root("theme"));
  const names = [...new Set(new URLSearchParams(location.search).getAll("results"))].slice(0, 4);
  if (!names.length) return say("No results are named: open them from the list of jobs.");
  root("title").textContent = names.join(" and ");
  document.title = `${names.join(" and ")} · explore`;
  try {
    const jobs = (await ask("GET", "/api/jobs")).jobs;
    const mechanisms = new Map(jobs.map(({ name, mechanism }) => [name, mechanism]));
    const other = names.find((name) => mechanisms.has(name) && mechanisms.get(name) !== mechanisms.get(names[0]));
    if (other) return say(`${names[0]} is of ${mechanisms.get(names[0])}, ${other} of ${mechanisms.get(other)}; results of one mechanism can be compared.`);
    offerComparison(names, jobs.filter(({ mechanism }) => mechanism === mechanisms.get(names[0])));
    await waitForIndexes(names, (share) => say(`Indexing the designs, once: ${Math.floor(100 * share)} %`));
    show(names, await browsingOf(names));
  } catch (error) {
    say(error.status === 401 ? "Open the link that the server printed when it started." : error.message);
  }
}

/** A list of the other finished results, to show one of them beside these. */
function offerComparison(names, jobs) {
  const others = jobs.filter((job) => job.state === "done" && !names.includes(job.name)).map((job) => job.name);
  if (!others.length || names.length > 3) return;
  const select = el(
    "select",
    { "aria-label": "compare with", onchange: () => (location.href = addressOf([...names, select.value])) },
    el("option", { value: "" }, "compare with …"),
    ...others.map((name) => el("option", { value: name }, name)),
  );
  root("compare").append(select);
}

function show(names, sources) {
  say("");
  root("browser").hidden = false;
  const conditions = new Conditions(sources);
  const told = summary(root("selection"), conditions, sources);
  const chosen = designs(root("design"), sources, (error) => say(error.message));
  const bars = histograms(root("histograms"), sources, conditions);
  const picture = cloud(root("cloud"), sources, conditions, chosen.choose, () => refresh());
  const table = ranking(root("ranking"), sources, conditions, chosen.choose);
  const refresh = latest(
    async () => {
      const [counted] = await Promise.all([bars.read(), picture.read()]);
      return counted;
    },
    (counted) => {
      bars.draw();
      picture.draw();
      told(counted.map(({ selected, designs: all }) => [selected, all]));
    },
    (error) => say(error.message),
  );
  const rank = latest(
    () => table.read(),
    (fronts) => {
      table.draw();
      picture.showFronts(fronts);
      chosen.takeFronts(fronts);
      if (!chosen.has()) {
        const first = fronts.findIndex((front) => front.designs.length);
        if (first >= 0) chosen.choose(first, fronts[first].designs[0].design, FRONT);
      }
    },
    (error) => table.say(error.message),
  );
  let timer = 0;
  conditions.listen(() => {
    say("");
    refresh();
    table.say("ranking …");
    clearTimeout(timer);
    timer = setTimeout(rank, PAUSE);
  });
  onTheme(() => {
    bars.draw();
    picture.draw();
  });
  refresh();
  table.say("ranking …");
  const linked = new URLSearchParams(location.search),
    design = linked.get("design"),
    place = Math.max(0, names.indexOf(linked.get("of")));
  if (/^\d+$/.test(design ?? "")) chosen.choose(place, Number(design));
  rank();
  root("subtitle").replaceChildren(
    el("a", { href: "/" }, "All jobs"),
    ` · ${sources.map((source) => countOf(source.designs, "design")).join(" and ")}`,
  );
}

start();
