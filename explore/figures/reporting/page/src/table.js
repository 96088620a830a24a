/** The table of the selected designs: only visible rows exist; sorted by any column, navigated with the arrow keys. */

import { el, oncePerFrame } from "./dom.js";
import { cell, count, words } from "./format.js";
import { KINDS, glyph } from "./marks.js";

const ROW = 28;
const SPARE = 6;
/** Number of designs on paper. */
const PRINTED = 40;

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {{selection: Object, hover: Object, chosen: Object}} shared
 */
export function table(root, model, shared) {
  const fields = [
    { name: "kind", title: "kind", unit: "", values: model.kinds, text: (row) => KINDS[model.kinds[row]].name },
    { name: "design", title: "design", unit: "", values: model.designs, text: (row) => count(model.designs[row]) },
    ...model.columns.map((column) => ({
      name: column.name,
      title: words(column.name),
      unit: column.unit,
      meaning: column.meaning,
      values: column.values,
      text: (row) => cell(column, column.values[row]),
    })),
  ];
  const state = { rows: [], sort: firstSort(model), down: false, active: 0 };
  state.down = model.study.objectives[0]?.[1] === "max";
  const head = el("div", { class: "row head", role: "row", "aria-rowindex": 1 });
  const body = el("div", { class: "body", role: "rowgroup" });
  const grid = el(
    "div",
    {
      class: "grid",
      role: "grid",
      tabindex: 0,
      "aria-label": "selected designs; arrow keys move, Enter chooses, P pins",
      "aria-colcount": fields.length,
    },
    el("div", { class: "head-group", role: "rowgroup" }, head),
    body,
  );
  const title = el("h2", {}, "Designs");
  const note = el("p", { class: "caption" });
  root.append(el("div", { class: "panel-head" }, title), grid, note);

  function headings() {
    head.replaceChildren(
      ...fields.map((field) =>
        el(
          "div",
          {
            role: "columnheader",
            class: `cell ${field.name === "kind" ? "kind" : ""}`,
            title: field.meaning ?? field.title,
            "aria-sort": state.sort === field.name ? (state.down ? "descending" : "ascending") : "none",
          },
          el(
            "button",
            { type: "button", onclick: () => sortBy(field.name) },
            el("span", { class: "name" }, field.title),
            el("span", { class: "unit" }, field.unit),
          ),
        ),
      ),
    );
  }

  function sortBy(name) {
    state.down = state.sort === name ? !state.down : name === "kind";
    state.sort = name;
    arrange();
  }

  function arrange() {
    const active = state.rows[state.active];
    const { values } = fields.find((field) => field.name === state.sort);
    const isObjective = model.study.objectives.some(([name]) => name === state.sort);
    state.rows = sorted(shared.selection.mask, values, model.kinds, state.down, isObjective);
    state.active = Math.max(0, state.rows.indexOf(active));
    grid.setAttribute("aria-rowcount", state.rows.length + 1);
    body.style.height = `${state.rows.length * ROW}px`;
    headings();
    fill();
  }

  function fill() {
    const height = grid.clientHeight || 400;
    const print = matchMedia("print").matches;
    const first = print ? 0 : Math.max(0, Math.floor(grid.scrollTop / ROW) - SPARE);
    const last = print
      ? Math.min(PRINTED, state.rows.length)
      : Math.min(state.rows.length, Math.ceil((grid.scrollTop + height) / ROW) + SPARE);
    body.replaceChildren(...Array.from({ length: Math.max(0, last - first) }, (_, k) => line(first + k)));
    grid.setAttribute("aria-activedescendant", state.rows.length ? `row-${state.active}` : "");
    note.textContent = state.rows.length
      ? print && state.rows.length > last
        ? `the first ${count(last)} of ${count(state.rows.length)} selected designs`
        : ""
      : "No design meets all conditions: clear a brush.";
  }

  function line(place) {
    const row = state.rows[place];
    const node = el(
      "div",
      {
        id: `row-${place}`,
        role: "row",
        "aria-rowindex": place + 2,
        "aria-selected": row === shared.chosen.row ? "true" : "false",
        class: `row${place === state.active ? " active" : ""}${row === shared.chosen.row ? " chosen" : ""}${row === shared.hover.row ? " hovered" : ""}`,
        onclick: () => {
          state.active = place;
          shared.chosen.set(row);
          fill();
        },
        onpointerenter: () => shared.hover.set(row),
        onpointerleave: () => shared.hover.set(-1),
      },
      ...fields.map((field) =>
        field.name === "kind"
          ? el(
              "div",
              { role: "gridcell", class: "cell kind" },
              mark(row),
            )
          : el("div", { role: "gridcell", class: "cell" }, field.text(row)),
      ),
    );
    node.style.top = `${place * ROW}px`;
    return node;
  }

  /** The mark of a row: chosen, pinned or its kind. */
  function mark(row) {
    const { name } = KINDS[model.kinds[row]];
    if (row === shared.chosen.row) return glyph("chosen", `chosen, ${name}`);
    if (!shared.pins.has(row)) return glyph(model.kinds[row], name);
    const { hue, marker } = shared.pins.lookOf(row);
    const node = glyph(marker, `pinned, ${name}`);
    node.classList.add(`hue-${hue}`);
    return node;
  }

  function walk(event) {
    const page = Math.max(1, Math.floor(grid.clientHeight / ROW) - 2);
    const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
    if (event.target !== grid) return;
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      if (state.rows.length) shared.chosen.set(state.rows[state.active]);
    } else if (event.key === "p" && state.rows.length) {
      shared.pins.toggle(state.rows[state.active]);
    } else if (event.key in steps) {
      event.preventDefault();
      state.active = Math.max(0, Math.min(state.rows.length - 1, state.active + steps[event.key]));
      shared.hover.set(state.rows[state.active] ?? -1);
      reveal();
    }
  }

  function reveal() {
    const top = state.active * ROW,
      room = grid.clientHeight - head.offsetHeight;
    if (top < grid.scrollTop) grid.scrollTop = top;
    else if (top + ROW > grid.scrollTop + room) grid.scrollTop = top + ROW - room;
    fill();
  }

  grid.addEventListener("scroll", oncePerFrame(fill));
  grid.addEventListener("keydown", walk);
  for (const name of ["beforeprint", "afterprint"]) addEventListener(name, fill);
  matchMedia("print").addEventListener("change", fill);
  shared.selection.listen(oncePerFrame(arrange));
  shared.chosen.listen(fill);
  shared.pins.listen(fill);
  arrange();
  return { rows: () => state.rows };
}

const firstSort = (model) => model.study.objectives[0]?.[0] ?? "design";

/**
 * The selected rows in the order of a column, undefined ones last, better kinds first where equal; of an objective
 * infeasible ones behind all others.
 */
function sorted(mask, values, kinds, down, isObjective) {
  const rows = new Uint32Array(mask.reduce((total, one) => total + one, 0));
  let n = 0;
  for (let row = 0; row < mask.length; row++) if (mask[row]) rows[n++] = row;
  const sign = down ? -1 : 1;
  return rows.sort((a, b) => {
    if (isObjective && !kinds[a] !== !kinds[b]) return kinds[a] ? -1 : 1;
    const x = values[a],
      y = values[b];
    if (x < y) return -sign;
    if (x > y) return sign;
    return Number.isNaN(x) - Number.isNaN(y) || kinds[b] - kinds[a] || a - b;
  });
}
