/** The bar of the selection: how many, by which conditions, and what to do with them. */

import { commandLine, nameable } from "./conditions.js";
import { csvText, save } from "./csv.js";
import { choice, el } from "./dom.js";
import { count, counted, number, titled, words } from "./format.js";

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {{selection: Object}} shared
 * @param {() => Iterable<number>} rows the selected ones in the order of the table
 * @param {() => void} typed called when a condition was typed
 */
export function toolbar(root, model, shared, rows, typed) {
  const { selection } = shared;
  const total = el("p", { class: "total", role: "status", "aria-live": "polite" });
  const chips = el("div", { class: "chips" });
  const line = el("code", { class: "command", tabindex: 0, "aria-label": "command that ranks this selection" });
  const said = el("span", { class: "said", role: "status" });
  const clear = el(
    "button",
    {
      type: "button",
      onclick: () => {
        selection.clear();
        typed();
      },
    },
    "Clear",
  );
  const kinds = [
    ["0", "all designs"],
    ["1", "feasible"],
    ["2", "Pareto-optimal"],
  ];
  const kind = choice("show", kinds, "0", (value) => selection.takeKind(Number(value)));
  root.append(
    el(
      "div",
      { class: "bar" },
      total,
      kind,
      clear,
      el(
        "button",
        {
          type: "button",
          class: "export",
          onclick: () => save(`${model.study.name}-selection.csv`, csvText(model, rows())),
        },
        "Export CSV",
      ),
    ),
    el("div", { class: "bar" }, field(model, selection, typed), chips),
    el(
      "div",
      { class: "bar rank" },
      line,
      el("button", { type: "button", class: "copy", onclick: () => copy(line.textContent, said) }, "Copy"),
      said,
    ),
  );

  function show() {
    const [infeasible, feasible, front] = selection.counts;
    const all = selection.total;
    const parts = [
      `${count(feasible + front)} feasible`,
      `${count(front)} Pareto-optimal`,
      `${count(infeasible)} infeasible`,
    ];
    total.replaceChildren(
      el("strong", {}, counted(all, "design")),
      ` ${selection.active ? `of ${count(model.size)} selected` : "on this page"} · ${parts.join(" · ")}`,
    );
    chips.replaceChildren(
      ...[...selection.brushes].flatMap(([key, conditions]) =>
        conditions.map((condition) =>
          el(
            "button",
            {
              type: "button",
              class: "chip",
              title: "remove",
              "aria-label": `remove the condition on ${words(condition.column)}`,
              onclick: () => {
                selection.set(key, []);
                typed();
              },
            },
            chipText(model, condition),
            el("span", { "aria-hidden": "true" }, " ×"),
          ),
        ),
      ),
    );
    clear.disabled = !selection.active;
    kind.querySelector("select").value = String(selection.least);
    const conditions = selection.conditions();
    line.textContent = commandLine(model.study.command, conditions);
    const unnamed = conditions.filter(({ column }) => !nameable(column)).map(({ column }) => column);
    said.textContent = unnamed.length ? `the command line cannot name ${unnamed.join(", ")}` : "";
  }

  selection.listen(show);
  show();
}

function chipText(model, { column, low, high }) {
  const known = model.byName.get(column),
    unit = known.unit ? ` ${known.unit}` : "";
  const value = (one) => known.labels?.[one] ?? number(one, 8);
  if (low <= -Number.MAX_VALUE && high === Infinity) return `${words(column)} is defined`;
  if (low === -Infinity) return `${words(column)} ≤ ${value(high)}${unit}`;
  if (high === Infinity) return `${words(column)} ≥ ${value(low)}${unit}`;
  return `${words(column)} ${value(low)} … ${value(high)}${unit}`;
}

/** A condition by numbers, for those who want it exact or use no mouse. */
function field(model, selection, typed) {
  let column = model.study.objectives[0]?.[0] ?? model.columns[0].name;
  const low = el("input", { type: "text", inputmode: "decimal", size: 8, placeholder: "from", "aria-label": "from" });
  const high = el("input", { type: "text", inputmode: "decimal", size: 8, placeholder: "to", "aria-label": "to" });
  const list = choice(
    "where",
    model.columns.map((one) => [one.name, titled(one)]),
    column,
    (value) => {
      column = value;
    },
  );
  const submit = (event) => {
    event.preventDefault();
    const read = (input, otherwise) => (input.value.trim() === "" ? otherwise : Number(input.value));
    const ends = { low: read(low, -Infinity), high: read(high, Infinity) };
    low.setAttribute("aria-invalid", Number.isNaN(ends.low));
    high.setAttribute("aria-invalid", Number.isNaN(ends.high));
    if (Number.isNaN(ends.low) || Number.isNaN(ends.high)) return;
    selection.set(`axis:${column}`, low.value.trim() || high.value.trim() ? [{ column, ...ends }] : []);
    low.value = high.value = "";
    typed();
  };
  return el("form", { class: "where", onsubmit: submit }, list, low, high, el("button", { type: "submit" }, "Add"));
}

async function copy(text, said) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = el("textarea", {}, text);
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  said.textContent = "copied";
  setTimeout(() => {
    said.textContent = "";
  }, 2000);
}
