/** How many designs are selected, and the conditions, each with a button that removes it. */

import { el } from "../../../figures/reporting/page/src/dom.js";
import { count, number, words } from "../../../figures/reporting/page/src/format.js";

/**
 * @param {HTMLElement} root
 * @param {import("./conditions.js").Conditions} conditions
 * @param {Array<Object>} sources
 * @returns {(counts: Array<[number, number]>) => void} shows the selected and all designs of each of the results
 */
export function summary(root, conditions, sources) {
  const total = el("p", { class: "total", id: "total", role: "status" });
  const button = (text, title, act) => el("button", { type: "button", title, onclick: act }, text);
  const chips = el("div", { class: "chips wrapped" });
  root.append(
    el(
      "div",
      { class: "bar" },
      total,
      button("Constraints of the study", "set the conditions to the constraints of the study", () => conditions.reset()),
      button("All designs", "remove all conditions", () => conditions.clear()),
    ),
    el("div", { class: "bar" }, chips),
  );
  const rangeText = (name, { low, high }) => {
    const unit = sources.find(({ byName }) => byName.has(name))?.byName.get(name).unit ?? "";
    const ends =
      low === -Infinity ? `≤ ${number(high)}` : high === Infinity ? `≥ ${number(low)}` : `${number(low)} … ${number(high)}`;
    return `${words(name)} ${ends} ${unit}`.trim();
  };
  function showChips() {
    chips.replaceChildren(
      ...[...conditions.ranges].map(([name, range]) => {
        const text = rangeText(name, range);
        return el(
          "button",
          { type: "button", class: "chip", "aria-label": `remove ${text}`, onclick: () => conditions.set(name, -Infinity, Infinity) },
          `${text} ×`,
        );
      }),
    );
    chips.parentElement.hidden = !conditions.ranges.size;
  }
  conditions.listen(showChips);
  showChips();
  return (counts) => {
    total.replaceChildren(
      ...counts.flatMap(([selected, all], k) => [
        ...(k ? [" · "] : []),
        ...(sources.length > 1 ? [`${sources[k].name}: `] : []),
        el("strong", {}, count(selected)),
        ` of ${count(all)} designs`,
      ]),
    );
  };
}
