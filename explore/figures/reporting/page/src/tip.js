/** The tip at the pointer: all columns of the design with their units. */

import { el } from "./dom.js";
import { cell, designName, words } from "./format.js";
import { KINDS, glyph } from "./marks.js";

/**
 * @param {HTMLElement} node the one that is shown and moved
 * @param {import("./payload.js").Model} model
 */
export function tips(node, model) {
  function show(row, x, y) {
    const rows = model.columns.map((column) =>
      el(
        "tr",
        {},
        el("th", {}, words(column.name)),
        el("td", {}, cell(column, column.values[row])),
        el("td", { class: "unit" }, column.unit),
      ),
    );
    const kind = model.kinds[row];
    node.replaceChildren(
      el("div", { class: "tip-head" }, glyph(kind), ` Design ${designName(model, row)}, ${KINDS[kind].name}`),
      el("table", {}, ...rows),
    );
    node.hidden = false;
    const { width, height } = node.getBoundingClientRect();
    const left = x + 16 + width > innerWidth ? Math.max(4, x - 16 - width) : x + 16;
    node.style.left = `${left}px`;
    node.style.top = `${Math.max(4, Math.min(y - 20, innerHeight - height - 4))}px`;
  }
  return {
    show,
    hide: () => {
      node.hidden = true;
    },
  };
}
