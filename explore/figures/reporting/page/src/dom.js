/** Builders of elements; every text becomes a text node, so that no text of a file is parsed as HTML. */

/**
 * Make an element.
 * @param {string} tag
 * @param {Object<string, any>} attributes names as in HTML; a function under `onNAME` is a listener, false leaves out
 * @param {...(Node|string|number)} children
 * @returns {HTMLElement}
 */
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") node.addEventListener(name.slice(2), value);
    else if (value !== false && value !== undefined && value !== null)
      node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.map((child) => (child instanceof Node ? child : String(child))));
  return node;
}

/**
 * A labelled list to choose from.
 * @param {string} label
 * @param {Array<[string, string]>} options value and text of each
 * @param {string} chosen
 * @param {(value: string) => void} onChoice
 */
export function choice(label, options, chosen, onChoice) {
  const select = el("select", { "aria-label": label, onchange: () => onChoice(select.value) });
  select.append(...options.map(([value, text]) => el("option", { value, selected: value === chosen }, text)));
  return el("label", { class: "field" }, el("span", {}, label), select);
}

/** A labelled check box; `onChange` is called with its state. */
export function check(label, checked, onChange, disabled = false) {
  const box = el("input", { type: "checkbox", checked, disabled, onchange: () => onChange(box.checked) });
  return el("label", { class: "check" }, box, el("span", {}, label));
}

/** An element of SVG. */
export function svg(tag, attributes = {}) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  return node;
}

/**
 * A canvas as sharp as the screen: its context is scaled to units of CSS pixels.
 * @param {HTMLCanvasElement} canvas
 * @returns {CanvasRenderingContext2D}
 */
export function resizeCanvas(canvas, width, height) {
  const ratio = Math.max(1, window.devicePixelRatio || 1);
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

/** The least width that is drawn, pixels: the margins of all plots and a little between them. */
const LEAST_WIDTH = 140;

/** Call `draw` now and whenever the width of the element changes. A plot in a narrower element reaches beyond it. */
export function onWidth(element, draw) {
  let width = 0;
  new ResizeObserver(() => {
    const now = element.clientWidth && Math.max(LEAST_WIDTH, Math.floor(element.clientWidth));
    if (now !== width && now > 0) draw((width = now));
  }).observe(element);
}

/** A function that runs at most once per frame, with the arguments of the last call. */
export function oncePerFrame(act) {
  let waiting = null;
  return (...args) => {
    if (waiting === null)
      requestAnimationFrame(() => {
        const last = waiting;
        waiting = null;
        act(...last);
      });
    waiting = args;
  };
}
