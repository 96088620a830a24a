/** Headings of parallel axes: name, unit and better side; dragging or the arrow keys reorder the axes. */

import { el } from "./dom.js";
import { words } from "./format.js";

const BETTER = { min: "▼ better", max: "▲ better" };
const MEANING = { min: "small is better", max: "large is better" };
/** Pixels that a pointer moves before it drags. */
const SLACK = 4;

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {(name: string, place: number) => void} move called when an axis is to stand elsewhere
 */
export function headings(root, model, move) {
  const senses = new Map(model.study.objectives),
    nodes = new Map();
  let axes = [],
    drag = null;

  const placeOf = (name) => axes.findIndex(({ column }) => column.name === name);

  function make(column) {
    const { name } = column,
      sense = senses.get(name);
    const node = el(
      "button",
      {
        type: "button",
        class: "heading",
        title: column.meaning,
        onkeydown: (event) => {
          const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
          if (!step) return;
          event.preventDefault();
          move(name, placeOf(name) + step);
        },
        onpointerdown: (event) => {
          node.setPointerCapture(event.pointerId);
          drag = { name, start: event.clientX, moved: false };
        },
        onpointermove: (event) => {
          if (drag?.name === name) follow(node, event.clientX);
        },
        onpointerup: drop,
        onpointercancel: drop,
      },
      el("span", {}, words(name)),
      column.unit ? el("span", { class: "unit" }, ` ${column.unit}`) : "",
      sense ? el("span", { class: "better" }, BETTER[sense]) : "",
    );
    return node;
  }

  /** The heading stays under the pointer, and its axis goes to the place that is nearest. */
  function follow(node, pointer) {
    drag.moved ||= Math.abs(pointer - drag.start) > SLACK;
    if (!drag.moved) return;
    const at = pointer - root.getBoundingClientRect().left;
    const distance = ({ x }) => Math.abs(x - at);
    const nearest = axes.reduce((best, axis, k) => (distance(axis) < distance(axes[best]) ? k : best), 0);
    if (nearest !== placeOf(drag.name)) move(drag.name, nearest);
    node.classList.add("dragged");
    node.style.transform = `translateX(${at - axes[placeOf(drag.name)].x}px)`;
  }

  function drop() {
    if (!drag) return;
    const node = nodes.get(drag.name);
    drag = null;
    node.classList.remove("dragged");
    node.style.transform = "";
    order();
  }

  /** The headings in the order of their axes, so that the tabulator key walks them so; what is dragged stays in place. */
  function order() {
    const wanted = axes.map(({ column }) => nodes.get(column.name));
    if (drag || (wanted.length === root.children.length && wanted.every((node, k) => node === root.children[k]))) return;
    const focused = document.activeElement;
    root.replaceChildren(...wanted);
    if (wanted.includes(focused)) focused.focus();
  }

  /** Put the headings of these axes above them, each as wide as `step` allows; returns the height of the tallest. */
  function place(wanted, step, width) {
    axes = wanted;
    for (const { column } of axes) if (!nodes.has(column.name)) nodes.set(column.name, make(column));
    order();
    const wide = Math.min(step - 2, 130);
    axes.forEach(({ column, x }, k) => {
      const node = nodes.get(column.name),
        sense = senses.get(column.name);
      node.setAttribute(
        "aria-label",
        `${words(column.name)}, axis ${k + 1} of ${axes.length}${sense ? `, ${MEANING[sense]}` : ""}; arrow keys move it`,
      );
      // In shares of the plot, which may be wider or narrower on paper.
      const left = Math.max(0, Math.min(width - wide, x - wide / 2));
      Object.assign(node.style, {
        left: `${(100 * left) / width}%`,
        width: `${(100 * wide) / width}%`,
        height: "auto",
      });
    });
    return Math.max(0, ...Array.from(root.children, (node) => node.offsetHeight));
  }

  /** Let all headings end at the same height, a share of the plot. */
  function stand(share) {
    for (const node of root.children) node.style.height = `${100 * share}%`;
  }

  return { place, stand };
}
