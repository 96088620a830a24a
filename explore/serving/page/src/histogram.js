/** One histogram: drag over it to select a range, click to remove it, or type its ends; arrow keys move an end. */

import { el, onWidth, resizeCanvas } from "../../../reporting/page/src/dom.js";
import { FILE_LOOKS } from "../../../reporting/page/src/files.js";
import { number, titled, words } from "../../../reporting/page/src/format.js";
import { colours } from "../../../reporting/page/src/theme.js";

const HEIGHT = 62;
/** Shares of the column's span that an arrow key moves an end by, without and with Shift; pixels of a click. */
const STEP = 0.01,
  LARGE_STEP = 0.1,
  CLICK = 3;
/** Width of the bar of one of few values over its share of the width. */
const BAR = 0.6;

/**
 * @param {Object} column
 * @param {Array<Object>} constraints of the study
 * @param {import("./conditions.js").Conditions} conditions
 * @param {number} files number of results that are drawn together
 */
export function histogram(column, constraints, conditions, files) {
  const { name, low, high } = column;
  const canvas = el("canvas", { class: "bars", role: "img", "aria-label": `distribution of ${words(name)}` });
  const ends = ["low", "high"].map((side) => endField(column, side, conditions));
  const limits = constraints.filter(({ metric }) => metric === name);
  const rule = limits.map(({ kind, limit }) => `${kind === "min" ? "≥" : "≤"} ${number(limit)}`).join(", ");
  const stage = el("div", {}, canvas);
  const node = el(
    "div",
    { class: "histogram", role: "group", "aria-label": words(name), "data-column": name },
    el("p", { class: "histogram-head", title: column.meaning }, titled(column), rule ? el("span", { class: "unit" }, ` constraint ${rule}`) : ""),
    stage,
    el("div", { class: "ends" }, ...ends.map(({ input }) => input)),
  );
  let width = 0,
    answers = [],
    dragged = null;
  const span = high - low || 1;
  const place = (value) => ((value - low) / span) * width;
  const value = (x) => round(low + (Math.min(Math.max(x, 0), width) / width) * span, span);

  function paint() {
    if (!width) return;
    const context = resizeCanvas(canvas, width, HEIGHT),
      own = colours();
    answers.forEach((answer, k) => {
      if (!answer) return;
      if (files === 1) bars(context, answer, answer.all, own.line);
      context.globalAlpha = files > 1 ? 0.55 : 0.9;
      bars(context, answer, answer.selected, files > 1 ? own[FILE_LOOKS[k].hue] : own.blue);
      context.globalAlpha = 1;
    });
    const range = dragged ?? conditions.of(name);
    context.fillStyle = own.panel;
    context.globalAlpha = 0.72;
    if (range.low > low) context.fillRect(0, 0, place(range.low), HEIGHT);
    if (range.high < high) context.fillRect(place(range.high), 0, width - place(range.high), HEIGHT);
    context.globalAlpha = 1;
    context.lineWidth = 2;
    context.strokeStyle = own.accent;
    for (const end of [range.low, range.high]) if (end >= low && end <= high) line(context, place(end));
    context.setLineDash([3, 3]);
    context.lineWidth = 1.5;
    context.strokeStyle = own.red;
    for (const { limit } of limits) if (limit >= low && limit <= high) line(context, place(limit));
  }

  function bars(context, answer, counts, colour) {
    const most = Math.max(...counts);
    if (!most) return;
    const isFew = column.distinct !== null && column.distinct <= counts.length;
    const bin = (answer.high - answer.low || 1) / counts.length;
    context.fillStyle = colour;
    counts.forEach((one, k) => {
      if (!one) return;
      // Few values fall into some bins only: their bars are wider, but do not touch.
      const wide = isFew ? (BAR * width) / column.distinct : Math.abs(place(answer.low + bin) - place(answer.low)),
        middle = place(answer.low + (k + 0.5) * bin),
        left = Math.min(Math.max(middle - wide / 2, 0), width - wide),
        tall = Math.max(1, (one / most) * (HEIGHT - 4));
      context.fillRect(left, HEIGHT - tall, Math.max(1, wide - 0.5), tall);
    });
  }

  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    const [start, open] = [event.offsetX, conditions.of(name)];
    // An end that is taken hold of is moved, elsewhere a new range begins.
    const held = ["low", "high"].find((side) => Math.abs(place(open[side]) - start) < 8);
    const fixed = held === "low" ? open.high : held === "high" ? open.low : value(start);
    canvas.onpointermove = (move) => {
      if (!dragged && Math.abs(move.offsetX - start) < CLICK) return;
      const [from, to] = [fixed, value(move.offsetX)].sort((a, b) => a - b);
      dragged = { low: from <= low ? -Infinity : from, high: to >= high ? Infinity : to };
      conditions.set(name, dragged.low, dragged.high);
      paint();
    };
    canvas.onpointerup = canvas.onpointercancel = () => {
      canvas.onpointermove = canvas.onpointerup = canvas.onpointercancel = null;
      if (!dragged && !held) conditions.set(name, -Infinity, Infinity);
      dragged = null;
    };
  };
  onWidth(stage, (now) => {
    width = now;
    paint();
  });
  conditions.listen(() => {
    paint();
    for (const end of ends) end.show();
  });
  return {
    node,
    draw(now) {
      answers = now;
      paint();
    },
  };
}

function line(context, x) {
  context.beginPath();
  context.moveTo(x, 0);
  context.lineTo(x, HEIGHT);
  context.stroke();
}

/** A value with no more digits than a pixel has. */
const round = (value, span) => Number(value.toPrecision(Math.max(4, 4 + Math.ceil(Math.log10(Math.abs(value) / span || 1)))));

/** A field of one end of a range; empty where it is open. */
function endField(column, side, conditions) {
  const { name, low, high } = column,
    open = side === "low" ? -Infinity : Infinity;
  const input = el("input", {
    type: "text",
    inputmode: "decimal",
    size: 8,
    placeholder: number(side === "low" ? low : high, 5),
    "aria-label": `${side === "low" ? "least" : "largest"} ${words(name)}`,
    title: "arrow keys move it, with Shift in large steps",
    onchange: () => take(input.value.trim() === "" ? open : Number(input.value.replace("−", "-"))),
    onkeydown: (event) => {
      const direction = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (!direction) return;
      event.preventDefault();
      const now = conditions.of(name)[side],
        span = high - low || 1;
      const start = Number.isFinite(now) ? now : side === "low" ? low : high;
      take(round(start + direction * span * (event.shiftKey ? LARGE_STEP : STEP), span));
    },
  });
  function take(value) {
    const range = { ...conditions.of(name), [side]: value };
    const isWrong = Number.isNaN(value) || range.low > range.high;
    input.setAttribute("aria-invalid", isWrong);
    if (!isWrong) conditions.set(name, range.low, range.high);
  }
  function show() {
    const now = conditions.of(name)[side];
    if (document.activeElement !== input || Number.isFinite(now)) input.value = Number.isFinite(now) ? String(now) : "";
    input.setAttribute("aria-invalid", false);
  }
  show();
  return { input, show };
}
