/** The values of the chosen design, or of all compared designs side by side. */

import { el } from "./dom.js";
import { cell, designName, titled, words } from "./format.js";
import { glyph } from "./marks.js";

/**
 * List values with units: parameters, objectives and constrained metrics first.
 * @param {HTMLElement} node
 * @param {import("./payload.js").Model} model
 * @param {Array<[number, Object]>} designs rows and looks
 */
export function listValues(node, model, designs) {
  const open = node.querySelector("details")?.open;
  const aims = new Set([...model.study.objectives, ...model.study.missed].map(([name]) => name));
  const matters = (column) => column.role === "parameter" || aims.has(column.name);
  const list = (columns) => (designs.length > 1 ? compared(model, columns, designs) : single(columns, designs[0][0]));
  const others = model.columns.filter((column) => !matters(column));
  node.replaceChildren(
    list(model.columns.filter(matters)),
    el("details", { open }, el("summary", {}, `${others.length} more values`), list(others)),
  );
}

const single = (columns, row) =>
  el(
    "dl",
    {},
    ...columns.map((column) =>
      el(
        "div",
        { title: column.meaning },
        el("dt", {}, words(column.name)),
        el(
          "dd",
          {},
          cell(column, column.values[row], 8),
          column.unit ? el("span", { class: "unit" }, ` ${column.unit}`) : "",
        ),
      ),
    ),
  );

const compared = (model, columns, designs) =>
  el(
    "div",
    { class: "sideways", tabindex: 0, role: "region", "aria-label": "values of the compared designs" },
    el(
      "table",
      { class: "compared" },
      el(
        "tr",
        {},
        el("td", {}),
        ...designs.map(([row, { hue, marker }]) =>
          el("th", { scope: "col" }, el("span", { class: `item hue-${hue}` }, glyph(marker), designName(model, row))),
        ),
      ),
      ...columns.map((column) =>
        el(
          "tr",
          { title: column.meaning },
          el("th", { scope: "row" }, titled(column)),
          ...designs.map(([row]) => el("td", {}, cell(column, column.values[row]))),
        ),
      ),
    ),
  );
