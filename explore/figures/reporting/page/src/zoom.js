/** Zoom of the scatter: buttons, keys, the wheel with Ctrl, two fingers, and dragging with Shift to move. */

import { el } from "./dom.js";

/** Magnification of a press of a button or key, and the share of the plot that an arrow key moves. */
const STEP = 1.5,
  SHIFT = 0.15;
/** Largest magnification: beyond it neighbouring pixels would have the same value. */
const MOST = 1e6;
/** Largest share of the plot that a drawn box takes where zooming in shows the box. */
const SMALLER = 0.9;

/**
 * Let a plot be zoomed and moved.
 * @param {Object} view with `scaleX` and `scaleY`, the same without zoom as `baseX` and `baseY`, and `zoom`, the shown
 *   ends of each axis, null where all is shown
 * @param {SVGElement} overlay takes the keys, wheel and fingers
 * @param {() => void} change called after each change of `view.zoom`
 * @param {() => ?Array} boxOf pixels of the drawn box, null for none
 * @returns {{node: HTMLElement, refresh: () => void, reset: () => void}}
 */
export function zoomTool(view, overlay, change, boxOf) {
  /** Show what lies between two pixels of each axis. */
  function show(x, y) {
    const ends = { x: shownEnds(view.scaleX, view.baseX, x), y: shownEnds(view.scaleY, view.baseY, y) };
    view.zoom = ends.x || ends.y ? ends : null;
    change();
  }

  function magnify(factor, [x, y] = centre()) {
    const around = (at, scale) => scale.range().map((end) => at + (end - at) / factor);
    show(around(x, view.scaleX), around(y, view.scaleY));
  }

  function move(dx, dy) {
    const moved = (by, scale) => scale.range().map((end) => end - by);
    show(moved(dx, view.scaleX), moved(dy, view.scaleY));
  }

  /** Show the drawn box, or the middle where there is none to show. */
  function zoomIn() {
    const box = boxOf();
    if (!box) return magnify(STEP);
    const [[left, top], [right, bottom]] = box;
    const [x0, x1] = view.scaleX.range(),
      [y0, y1] = view.scaleY.range();
    const isInside = left >= x0 - 1 && right <= x1 + 1 && top >= y1 - 1 && bottom <= y0 + 1;
    const isSmall = Math.max((right - left) / (x1 - x0), (bottom - top) / (y0 - y1)) < SMALLER;
    if (!isInside || !isSmall) return magnify(STEP);
    const [dx, dy] = [0.04 * (right - left), 0.04 * (bottom - top)];
    show([left - dx, right + dx], [bottom + dy, top - dy]);
  }

  function reset() {
    view.zoom = null;
    change();
  }

  const centre = () => [view.scaleX, view.scaleY].map((scale) => scale.range().reduce((a, b) => (a + b) / 2));
  const button = (text, label, title, onclick) => el("button", { type: "button", "aria-label": label, title, onclick }, text);
  const closer = button("+", "zoom in", "zoom in: to the box, if one is drawn", zoomIn);
  const wider = button("−", "zoom out", "zoom out", () => magnify(1 / STEP));
  const all = button("Reset", "show all", "show all", reset);
  const node = el("span", { class: "zoom", role: "group", "aria-label": "zoom" }, closer, wider, all);

  const keys = {
    "+": zoomIn,
    "=": zoomIn,
    "-": () => magnify(1 / STEP),
    0: reset,
    ArrowLeft: () => move(SHIFT * view.width, 0),
    ArrowRight: () => move(-SHIFT * view.width, 0),
    ArrowUp: () => move(0, SHIFT * view.height),
    ArrowDown: () => move(0, -SHIFT * view.height),
  };
  overlay.addEventListener("keydown", (event) => {
    if (event.target !== overlay || event.ctrlKey || event.metaKey || !Object.hasOwn(keys, event.key)) return;
    event.preventDefault();
    keys[event.key]();
  });
  const place = ({ clientX, clientY }) => {
    const { left, top } = overlay.getBoundingClientRect();
    return [clientX - left, clientY - top];
  };
  overlay.addEventListener(
    "wheel",
    (event) => {
      // Without a key the wheel scrolls the page; two fingers on a touchpad come as a wheel with Ctrl.
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 20 : 1;
      magnify(2 ** Math.min(1, Math.max(-1, (-event.deltaY * lines) / 150)), place(event));
    },
    { passive: false },
  );
  dragToMove(overlay, move);
  pinch(overlay, place, (factor, before, now) => {
    magnify(factor, before);
    move(now[0] - before[0], now[1] - before[1]);
  });

  /** Buttons that would do nothing are off. */
  function refresh() {
    wider.disabled = all.disabled = !view.zoom;
  }

  return { node, refresh, reset };
}

/** Ends of an axis between two pixels; null where they show all, the present ones beyond the largest magnification. */
function shownEnds(scale, base, pixels) {
  const ends = pixels.map((pixel) => scale.invert(pixel));
  const [first, last] = scale.range();
  const share = Math.abs((base(ends[1]) - base(ends[0])) / (last - first));
  if (!(share < 1 - 1e-6)) return null;
  return share < 1 / MOST ? scale.domain() : ends;
}

/** Whether a press begins a move and not a box. */
export const isMove = (event) => event.shiftKey && !event.ctrlKey && !event.metaKey;

function dragToMove(overlay, move) {
  let last = null;
  overlay.addEventListener("pointerdown", (event) => {
    if (!isMove(event) || event.button) return;
    overlay.setPointerCapture(event.pointerId);
    last = [event.clientX, event.clientY];
  });
  overlay.addEventListener("pointermove", (event) => {
    if (!last) return;
    const now = [event.clientX, event.clientY];
    move(now[0] - last[0], now[1] - last[1]);
    last = now;
  });
  for (const name of ["pointerup", "pointercancel"])
    overlay.addEventListener(name, () => {
      last = null;
    });
}

/** Follow two fingers, which the brush must not see. */
function pinch(overlay, place, onPinch) {
  let before = null;
  const fingers = ({ touches }) => {
    const [a, b] = [place(touches[0]), place(touches[1])];
    return { middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], distance: Math.hypot(a[0] - b[0], a[1] - b[1]) };
  };
  const follow = (event) => {
    if (event.touches.length !== 2) return;
    if (event.cancelable) event.preventDefault();
    event.stopPropagation();
    const now = fingers(event);
    if (before && event.type === "touchmove") onPinch(now.distance / before.distance, before.middle, now.middle);
    before = now;
  };
  const options = { capture: true, passive: false };
  overlay.addEventListener("touchstart", follow, options);
  overlay.addEventListener("touchmove", follow, options);
  for (const name of ["touchend", "touchcancel"])
    overlay.addEventListener(name, () => {
      before = null;
    });
}
