/** Zoom of a plot: drag a window over it, buttons, and the keys + - 0 and arrows. */

import { el } from "../../../figures/reporting/page/src/dom.js";

/** Pixels that a drag is at least; how much closer a step comes; share of the window that an arrow key moves by. */
const CLICK = 4,
  STEP = 1.6,
  MOVE = 0.2;

/**
 * @param {HTMLCanvasElement} canvas
 * @param {{scaleX?: Function, scaleY?: Function, window: ?Object}} view
 * @param {{left: number, right: number, top: number, bottom: number}} margin
 * @param {(window: ?{x: [number, number], y: [number, number]}) => void} set null shows all
 */
export function zoomable(canvas, view, margin, set) {
  let dragged = false;
  const frame = el("div", { class: "window", hidden: true });
  const now = () => view.window ?? { x: view.scaleX.domain(), y: view.scaleY.domain() };
  const scaled = ([low, high], factor) => {
    const [middle, half] = [(low + high) / 2, ((high - low) / 2) * factor];
    return [middle - half, middle + half];
  };
  const moved = ([low, high], share) => [low + share * (high - low), high + share * (high - low)];
  const by = (factor) => view.scaleX && set({ x: scaled(now().x, factor), y: scaled(now().y, factor) });
  const move = (x, y) => view.scaleX && set({ x: moved(now().x, x), y: moved(now().y, y) });
  const keys = {
    "+": () => by(1 / STEP),
    "-": () => by(STEP),
    0: () => set(null),
    ArrowLeft: () => move(-MOVE, 0),
    ArrowRight: () => move(MOVE, 0),
    ArrowDown: () => move(0, -MOVE),
    ArrowUp: () => move(0, MOVE),
  };
  canvas.onkeydown = (event) => {
    if (!Object.hasOwn(keys, event.key) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  };
  canvas.onpointerdown = (event) => {
    if (!view.scaleX) return;
    if (!frame.parentElement) canvas.parentElement.append(frame);
    const [startX, startY] = [event.offsetX, event.offsetY];
    dragged = false;
    canvas.setPointerCapture(event.pointerId);
    const place = ({ offsetX, offsetY }) => ({
      x: [startX, offsetX].sort((a, b) => a - b),
      y: [startY, offsetY].sort((a, b) => a - b),
    });
    canvas.onpointermove = (to) => {
      const { x, y } = place(to);
      if (x[1] - x[0] < CLICK || y[1] - y[0] < CLICK) return;
      dragged = true;
      frame.hidden = false;
      Object.assign(frame.style, { left: `${x[0]}px`, top: `${y[0]}px`, width: `${x[1] - x[0]}px`, height: `${y[1] - y[0]}px` });
    };
    canvas.onpointerup = canvas.onpointercancel = (to) => {
      canvas.onpointermove = canvas.onpointerup = canvas.onpointercancel = null;
      frame.hidden = true;
      if (!dragged || to.type === "pointercancel") return;
      const { x, y } = place(to);
      set({ x: x.map((one) => view.scaleX.invert(one)), y: y.reverse().map((one) => view.scaleY.invert(one)) });
    };
  };
  const button = (text, label, act) => el("button", { type: "button", "aria-label": label, title: label, onclick: act }, text);
  return {
    buttons: [
      el(
        "span",
        { class: "zoom" },
        button("+", "zoom in", keys["+"]),
        button("−", "zoom out", keys["-"]),
        button("All", "show all designs", keys[0]),
      ),
    ],
    wasDragged: () => dragged,
  };
}
