/** The bar of the selection: its size, its conditions, export and command. */

import { commandLine, isNameable } from "./conditions.js";
import { csvText, save } from "./csv.js";
import { choice, el } from "./dom.js";
import { field } from "./field.js";
import { count, countOf, number, words } from "./format.js";

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {{selection: Object}} shared
 * @param {() => Iterable<number>} rows the selected ones in the order of the table
 * @param {() => void} onType called when a condition was typed
 */
export function toolbar(root, model, shared, rows, onType) {
  const { selection } = shared;
  const total = el("p", { class: "total", role: "status", "aria-live": "polite" });
  const chips = el("div", { class: "chips" });
  const line = el("code", { class: "command", tabindex: 0, "aria-label": "command that ranks this selection" });
  const status = el("span", { class: "status", role: "status" });
  const clear = el(
    "button",
    {
      type: "button",
      onclick: () => {
        selection.clear();
        onType();
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
    el("div", { class: "bar" }, field(model, selection, onType), chips),
    el(
      "div",
      { class: "bar rank" },
      line,
      el("button", { type: "button", class: "copy", onclick: () => copy(line.textContent, status) }, "Copy"),
      status,
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
      el("strong", {}, countOf(all, "design")),
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
                onType();
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
    // The column of files is of the page alone.
    const canName = ({ column }) => isNameable(column) && !model.byName.get(column).verbatim;
    const conditions = selection.conditions();
    line.textContent = commandLine(model.study.command, conditions.filter(canName));
    const unnamed = conditions.filter((condition) => !canName(condition)).map(({ column }) => column);
    status.textContent = unnamed.length ? `the command line cannot name ${unnamed.join(", ")}` : "";
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

async function copy(text, status) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = el("textarea", {}, text);
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  status.textContent = "copied";
  setTimeout(() => {
    status.textContent = "";
  }, 2000);
}
