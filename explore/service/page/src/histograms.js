/** Histograms of columns with ranges to select: all designs grey, those within the other columns' ranges in colour. */

import { el } from "../../../figures/reporting/page/src/dom.js";
import { FILE_LOOKS } from "../../../figures/reporting/page/src/files.js";
import { words } from "../../../figures/reporting/page/src/format.js";
import { histogram } from "./histogram.js";
import { byWeight, query } from "./sources.js";

/** Columns that are shown first, at most. */
const SHOWN = 8;

/**
 * @param {HTMLElement} root
 * @param {Array<Object>} sources
 * @param {import("./conditions.js").Conditions} conditions
 */
export function histograms(root, sources, conditions) {
  const [first] = sources;
  const names = byWeight(first);
  const grid = el("div", { class: "histograms" });
  const shown = new Map();
  const add = (name) => {
    const own = histogram(together(sources, name), first.constraints, conditions, sources.length);
    shown.set(name, own);
    grid.append(own.node);
  };
  names.slice(0, SHOWN).forEach(add);
  const others = [...first.byName.keys()].filter((name) => !shown.has(name));
  const menu = el(
    "select",
    {
      "aria-label": "show another column",
      onchange: () => {
        add(menu.value);
        menu.selectedOptions[0].remove();
        menu.value = "";
        conditions.change();
      },
    },
    el("option", { value: "" }, "another column …"),
    ...others.map((name) => el("option", { value: name }, words(name))),
  );
  const legend =
    sources.length > 1
      ? sources.map(({ name }, k) => el("span", { class: "item" }, el("i", { class: `swatch hue-${FILE_LOOKS[k].hue}` }), name))
      : [
          el("span", { class: "item" }, el("i", { class: "swatch all" }), "all designs"),
          el("span", { class: "item" }, el("i", { class: "swatch within" }), "within the ranges of the other columns"),
        ];
  root.append(
    el("div", { class: "panel-head" }, el("h2", {}, "Distributions"), el("p", { class: "legend small" }, ...legend), others.length ? menu : ""),
    grid,
  );
  let answers = [];
  return {
    async read() {
      answers = await Promise.all(
        sources.map((source) => {
          const columns = [...shown.keys()].filter((name) => source.byName.has(name)).join(",");
          return query(source, "histograms", { columns, where: conditions.texts(source) });
        }),
      );
      return answers;
    },
    draw() {
      for (const [name, own] of shown)
        own.draw(answers.map((answer) => answer.columns.find((column) => column.name === name) ?? null));
    },
  };
}

/** A column of the first results, with the range of its values in all of them. */
function together([first, ...others], name) {
  const columns = [first, ...others].map(({ byName }) => byName.get(name)).filter(Boolean);
  const distinct = columns.some((column) => column.distinct === null) ? null : Math.max(...columns.map((column) => column.distinct));
  return { ...first.byName.get(name), low: Math.min(...columns.map(({ low }) => low)), high: Math.max(...columns.map(({ high }) => high)), distinct };
}
