/** Designs pinned for a comparison: at most four, each with a colour, a dash and a marker of its own. */

import { el, svg } from "./dom.js";
import { designName } from "./format.js";
import { SHAPES } from "./marks.js";

/** Looks of the pinned designs; a design keeps its look while others come and go. */
export const LOOKS = [
  { hue: "blue", dash: [8, 4], marker: "square" },
  { hue: "orange", dash: [2.5, 2.5], marker: "triangle" },
  { hue: "purple", dash: [9, 3, 2, 3], marker: "diamond" },
  { hue: "ink", dash: [14, 3, 2, 3, 2, 3], marker: "wedge" },
];
/** Look of the chosen design where it is not pinned. */
export const CHOSEN_LOOK = { hue: "green", dash: [], marker: "chosen" };

export class Pins {
  constructor() {
    this.slots = LOOKS.map(() => -1);
    this.listeners = [];
  }

  /** Call after each change. */
  listen(listener) {
    this.listeners.push(listener);
  }

  /** Rows of the pinned designs. */
  get rows() {
    return this.slots.filter((row) => row >= 0);
  }

  has(row) {
    return row >= 0 && this.slots.includes(row);
  }

  /** Whether a design can be pinned or unpinned. */
  allows(row) {
    return row >= 0 && (this.has(row) || this.slots.includes(-1));
  }

  lookOf(row) {
    return this.has(row) ? LOOKS[this.slots.indexOf(row)] : CHOSEN_LOOK;
  }

  /** Pin a design, or unpin it if it is pinned. */
  toggle(row) {
    if (!this.allows(row)) return;
    const [from, to] = this.has(row) ? [row, -1] : [-1, row];
    this.slots[this.slots.indexOf(from)] = to;
    for (const listener of this.listeners) listener();
  }

  /** The pinned designs and the chosen one, which is last if it is not pinned. */
  compared(chosen) {
    return chosen < 0 || this.has(chosen) ? this.rows : [...this.rows, chosen];
  }
}

/** A short piece of a design's line with its marker. */
function sample({ hue, dash, marker }) {
  const node = svg("svg", { width: 36, height: 14, viewBox: "-18 -7 36 14", class: `sample hue-${hue}`, "aria-hidden": "true" });
  node.append(
    svg("path", { d: "M-18,0H18", "stroke-dasharray": dash.join(" ") }),
    svg("path", { d: SHAPES[marker], class: "marker" }),
  );
  return node;
}

/**
 * The button that pins the chosen design, and the legend of the compared designs, with buttons to choose and unpin each.
 * @param {import("./payload.js").Model} model
 * @param {Pins} pins
 * @param {import("./selection.js").Focus} chosen
 */
export function pinBoard(model, pins, chosen) {
  const button = el("button", { type: "button", class: "pin-button", onclick: () => toggle(chosen.row) });
  const legend = el("div", { class: "pins", role: "group", "aria-label": "compared designs" });
  const status = el("p", { class: "unseen", role: "status" });

  function toggle(row) {
    pins.toggle(row);
    status.textContent = `design ${designName(model, row)} ${pins.has(row) ? "pinned" : "unpinned"}, ${pins.rows.length} of ${LOOKS.length}`;
    button.focus();
  }

  function item(row) {
    const name = designName(model, row);
    const choose = el(
      "button",
      { type: "button", class: "plain", "aria-label": `choose design ${name}`, onclick: () => chosen.set(row) },
      sample(pins.lookOf(row)),
      name,
    );
    const unpin = el(
      "button",
      { type: "button", class: "plain", "aria-label": `unpin design ${name}`, title: "unpin", onclick: () => toggle(row) },
      "×",
    );
    return el("span", { class: "pin" }, choose, pins.has(row) ? unpin : el("span", { class: "unit" }, "chosen"));
  }

  function show() {
    const pinned = pins.has(chosen.row);
    button.textContent = pinned ? "Unpin" : "Pin";
    button.setAttribute("aria-pressed", pinned);
    button.disabled = !pins.allows(chosen.row);
    button.title = button.disabled ? "four designs are pinned; unpin one first" : "pinned designs are drawn together";
    legend.replaceChildren(...(pins.rows.length ? pins.compared(chosen.row).map(item) : []));
  }

  return { button, legend, status, show };
}
