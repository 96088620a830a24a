/** The Pareto set of the selected designs, best first; a row is chosen by its button. */

import { choice, el } from "../../../figures/reporting/page/src/dom.js";
import { count, countOf, number, titled } from "../../../figures/reporting/page/src/format.js";
import { FRONT } from "../../../figures/reporting/page/src/payload.js";
import { query } from "./sources.js";

/** Designs that are asked for of each of the results, and lines that are shown. */
const TOP = 500,
  LINES = 50;

/**
 * @param {HTMLElement} root
 * @param {Array<Object>} sources
 * @param {import("./conditions.js").Conditions} conditions
 * @param {(source: number, design: number, kind: number) => void} choose
 */
export function ranking(root, sources, conditions, choose) {
  const [first] = sources;
  const names = first.objectives.map((text) => text.split(":")[0]);
  let order = names[0] ?? first.rank_metrics[0];
  const status = el("p", { class: "caption", role: "status" });
  const table = el("table", { class: "ranked" });
  const list = choice(
    "best in",
    [...new Set([...names, ...first.rank_metrics])].map((name) => [name, titled(first.byName.get(name) ?? { name, unit: "" })]),
    order,
    (name) => {
      order = name;
      conditions.change();
    },
  );
  const say = (text) => (status.textContent = text);
  root.append(
    el("div", { class: "panel-head" }, el("h2", {}, "Pareto set"), el("div", { class: "controls" }, list)),
    status,
    el("div", { class: "sideways", tabindex: 0, role: "region", "aria-label": "table of the Pareto set" }, table),
  );
  let fronts = [];

  function draw() {
    const found = fronts.map(({ found: all }, k) => (sources.length > 1 ? `${sources[k].name}: ` : "") + countOf(all, "Pareto-optimal design"));
    const listed = fronts.reduce((sum, { designs }) => sum + Math.min(LINES, designs.length), 0);
    const all = fronts.reduce((sum, { found: one }) => sum + one, 0);
    say(`${found.join(", ")} among the feasible ones that are selected${listed < all ? `; the best ${count(listed)}` : ""}.`);
    const swept = first.columns.filter(({ kind, distinct }) => kind === "parameter" && distinct !== 1).map(({ name }) => name);
    const shown = [...new Set([order, ...names, ...swept])].filter((name) => first.byName.has(name));
    const head = el(
      "tr",
      {},
      ...(sources.length > 1 ? [el("th", { scope: "col" }, "results")] : []),
      el("th", { scope: "col" }, "design"),
      ...shown.map((name) => el("th", { scope: "col" }, titled(first.byName.get(name)))),
    );
    const listedDesigns = fronts.flatMap((front, k) => front.designs.slice(0, LINES).map((design) => ({ front, k, design })));
    const rows = bestFirst(listedDesigns, order).map(({ front, k, design }) =>
      el(
        "tr",
        {},
        ...(sources.length > 1 ? [el("td", {}, sources[k].name)] : []),
        el(
          "th",
          { scope: "row" },
          el("button", { type: "button", class: "link", "aria-label": `choose design ${design.design}`, onclick: () => choose(k, design.design, FRONT) }, count(design.design)),
        ),
        ...shown.map((name) => el("td", {}, number(front.value(design, name) ?? NaN))),
      ),
    );
    table.replaceChildren(el("thead", {}, head), el("tbody", {}, ...rows));
  }

  return {
    say,
    draw,
    async read() {
      const answers = await Promise.all(
        sources.map((source) =>
          query(source, "rank", { metric: order, where: conditions.texts(source).join(" and ") || null, top: TOP }),
        ),
      );
      const value = ({ units }) => (design, name) => design[name] ?? design[`${name} [${units[name]}]`];
      fronts = answers.map((answer) => ({ ...answer, value: value(answer) }));
      return fronts;
    },
  };
}

/** Designs of several results together, best first, where the metric is an objective; else each as they are. */
function bestFirst(listed, metric) {
  const aim = listed[0]?.front.objectives.find((text) => text.split(":")[0] === metric);
  if (!aim) return listed;
  const sign = aim.endsWith(":max") ? -1 : 1;
  return [...listed].sort((a, b) => sign * (a.front.value(a.design, metric) - b.front.value(b.design, metric)));
}
