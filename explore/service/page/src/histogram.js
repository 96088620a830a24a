/** One histogram: drag over it to select a range, click to remove it, or type its ends; arrow keys move an end. */

import { el, onWidth, resizeCanvas } from "../../../figures/reporting/page/src/dom.js";
import { FILE_LOOKS } from "../../../figures/reporting/page/src/files.js";
import { number, titled, words } from "../../../figures/reporting/page/src/format.js";
import { colours } from "../../../figures/reporting/page/src/theme.js";

const HEIGHT = 62;
/** Shares of the column's span that an arrow key moves an end by, without and with Shift; pixels of a click. */
const STEP = 0.01,
  LARGE_STEP = 0.1,
  CLICK = 3;
/** Width of the bar of one of few values over its share of the width, and the largest number of values that are few. */
const BAR = 0.7,
  FEW = 64;

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
  const span = high - low || 1,
    isFew = column.distinct !== null && column.distinct <= FEW;
  let [start, stop] = low < high ? [low, high] : [low - 0.5, high + 0.5];
  const place = (value) => ((value - start) / (stop - start)) * width;
  const value = (x) => round(start + (Math.min(Math.max(x, 0), width) / width) * (stop - start), span);

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
    const bin = (answer.high - answer.low || 1) / counts.length,
      first = answer.high > answer.low ? answer.low : answer.low - 0.5,
      wide = (isFew ? BAR * gap(answer.all) : 1) * (place(bin) - place(0));
    context.fillStyle = colour;
    counts.forEach((one, k) => {
      if (!one) return;
      const middle = place(first + (k + 0.5) * bin),
        tall = Math.max(1, (one / most) * (HEIGHT - 4));
      context.fillRect(middle - wide / 2, HEIGHT - tall, Math.max(1, wide - (isFew ? 0 : 0.5)), tall);
    });
  }

  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    const [from, open] = [event.offsetX, conditions.of(name)];
    // An end that is taken hold of is moved, elsewhere a new range begins.
    const held = ["low", "high"].find((side) => Math.abs(place(open[side]) - from) < 8);
    const fixed = held === "low" ? open.high : held === "high" ? open.low : value(from);
    canvas.onpointermove = (move) => {
      if (!dragged && Math.abs(move.offsetX - from) < CLICK) return;
      const [least, largest] = [fixed, value(move.offsetX)].sort((a, b) => a - b);
      dragged = { low: least <= low ? -Infinity : least, high: largest >= high ? Infinity : largest };
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
      for (const answer of answers.filter((one) => one && one.low < one.high)) {
        // Bins of a grid begin half a step before it; else the first and the last bar need room.
        const room = isFew && !answer.values_per_bin ? (gap(answer.all) * (answer.high - answer.low)) / answer.all.length / 2 : 0;
        [start, stop] = [Math.min(start, answer.low - room), Math.max(stop, answer.high + room)];
      }
      paint();
    },
  };
}

/** The least distance of two bins that hold designs, so that bars of few values do not touch. */
function gap(counts) {
  const filled = counts.flatMap((one, k) => (one ? [k] : []));
  return filled.length < 2 ? counts.length : Math.min(...filled.slice(1).map((k, place) => k - filled[place]));
}

function line(context, x) {
  context.beginPath();
  context.moveTo(x, 0);
  context.lineTo(x, HEIGHT);
  context.stroke();
}

/** A value with no more digits than a pixel has, and at least so many. */
const round = (value, span, least = 4) => Number(value.toPrecision(Math.min(17, Math.max(least, 4 + Math.ceil(Math.log10(Math.abs(value) / span || 1))))));

/** Digits of a field, at least; the condition keeps all of a limit that the study gives with rounding errors. */
const FIELD = 7;

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
    if (document.activeElement !== input || Number.isFinite(now)) input.value = Number.isFinite(now) ? String(round(now, high - low || 1, FIELD)) : "";
    input.setAttribute("aria-invalid", false);
  }
  show();
  return { input, show };
}
