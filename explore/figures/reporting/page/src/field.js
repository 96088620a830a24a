/** A condition typed as numbers: exact, and without a mouse. */

import { choice, el } from "./dom.js";
import { titled } from "./format.js";

/**
 * @param {import("./payload.js").Model} model
 * @param {import("./selection.js").Selection} selection
 * @param {() => void} onType called when a condition was typed
 */
export function field(model, selection, onType) {
  let column = model.study.objectives[0]?.[0] ?? model.columns[0].name;
  const reason = el("span", { class: "reason", id: "bound-reason", role: "alert" });
  const [low, high] = ["from", "to"].map((name) =>
    el("input", {
      type: "text",
      inputmode: "decimal",
      size: 8,
      placeholder: name,
      "aria-label": name,
      "aria-describedby": reason.id,
      oninput: () => reason.textContent && say(),
      onchange: () => say(),
    }),
  );
  const list = choice(
    "where",
    model.columns.map((one) => [one.name, titled(one)]),
    column,
    (value) => {
      column = value;
    },
  );

  /** Say what is wrong beside the fields, or nothing; returns whether they are right. */
  function say() {
    const wrong = problem(low.value, high.value);
    for (const [input, name] of [
      [low, "low"],
      [high, "high"],
    ])
      input.setAttribute("aria-invalid", Boolean(wrong?.of.includes(name)));
    if (reason.textContent !== (wrong?.words ?? "")) reason.textContent = wrong?.words ?? "";
    return !wrong;
  }

  const submit = (event) => {
    event.preventDefault();
    if (!say()) return;
    const ends = { low: bound(low.value, -Infinity), high: bound(high.value, Infinity) };
    selection.set(`axis:${column}`, low.value.trim() || high.value.trim() ? [{ column, ...ends }] : []);
    low.value = high.value = "";
    onType();
  };
  return el("form", { class: "where", onsubmit: submit }, list, low, high, el("button", { type: "submit" }, "Add"), reason);
}

const bound = (text, otherwise) => (text.trim() === "" ? otherwise : Number(text));

/** What is wrong with two bounds, and with which of them; null if nothing. */
function problem(lowText, highText) {
  const [low, high] = [bound(lowText, -Infinity), bound(highText, Infinity)];
  for (const [value, text, name] of [
    [low, lowText, "low"],
    [high, highText, "high"],
  ])
    if (Number.isNaN(value)) return { words: `“${text.trim()}” is not a number; write it like 12.5 or 1e-3`, of: [name] };
  return low > high ? { words: `from ${lowText.trim()} is above to ${highText.trim()}`, of: ["low", "high"] } : null;
}
