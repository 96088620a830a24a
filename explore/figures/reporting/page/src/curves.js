/** Small charts of a motion over the input angle, all with the same cursor. */

import { el, resizeCanvas } from "./dom.js";
import { number, tickText } from "./format.js";
import { glyph, markAt } from "./marks.js";
import { strokeOf } from "./mechanism.js";
import { axisScale } from "./scales.js";
import { isTurn, partsIn, shownAngle } from "./span.js";
import { colours } from "./theme.js";

const HEIGHT = 118;
const MARGIN = { left: 42, right: 8, top: 6, bottom: 18 };

/**
 * Make a chart.
 * @param {{title: string, unit: string, fromZero: boolean, motion: ?Object, traces: Array}} kind from `panelsOf` or
 *   `comparedPanels`; strokes and marks are those of `motion`
 * @param {[number, number]} span first and last input angle of the axis, deg
 * @param {Array<[string, string, number, string|[number, number]]>} bounds of the study on signals: name, side, value, and
 *   the stroke or the input angles where it holds
 * @param {(degrees: number) => void} onPoint called with the input angle under the pointer
 */
export function curveChart(kind, span, bounds, onPoint) {
  const canvas = el("canvas", { role: "img" });
  const value = el("span", { class: "value" });
  const title = el("span", { class: "title" }, kind.unit ? `${kind.title} [${kind.unit}]` : kind.title);
  const node = el("figure", { class: "curve" }, el("figcaption", {}, title, value), canvas);
  const point = (event) => {
    if (event.type === "pointermove" && !event.buttons) return;
    const { left, width } = canvas.getBoundingClientRect();
    const share = (event.clientX - left - MARGIN.left) / (width - MARGIN.left - MARGIN.right);
    onPoint(span[0] + Math.min(1, Math.max(0, share)) * (span[1] - span[0]));
  };
  canvas.addEventListener("pointerdown", point);
  canvas.addEventListener("pointermove", point);
  const drawn = { ...kind, over: span, bounds: bounds.filter(([signal]) => kind.traces.some(({ name }) => name === signal)) };
  return { node, draw: (degrees, width) => draw(drawn, canvas, value, degrees, width) };
}

function draw(kind, canvas, value, degrees, width) {
  const context = resizeCanvas(canvas, width, HEIGHT);
  const colour = colours();
  const x = axisScale(kind.over, [MARGIN.left, width - MARGIN.right]);
  const { traces } = kind;
  const all = traces.flatMap(({ values }) => [...values]).filter(Number.isFinite);
  if (!all.length) {
    context.fillStyle = colour.muted;
    context.font = "12px system-ui, sans-serif";
    context.fillText(kind.empty, MARGIN.left, HEIGHT / 2);
    canvas.setAttribute("aria-label", `${kind.title}: ${kind.empty}`);
    value.textContent = "";
    return;
  }
  const span = [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))];
  if (kind.fromZero) span[0] = 0;
  if (kind.marks?.length) span[1] = Math.max(span[1], ...kind.marks.map(([, one]) => one));
  span[1] = Math.min(span[1], kind.most ?? Infinity);
  const y = axisScale(span, [HEIGHT - MARGIN.bottom, MARGIN.top], { room: 0.08 });
  frame(context, x, y, kind.motion, colour, width);
  for (const motion of new Set(traces.map((trace) => trace.motion))) drawBounds(context, kind, motion, x, y, colour);
  context.save();
  context.beginPath();
  context.rect(MARGIN.left, 0, width - MARGIN.left - MARGIN.right, HEIGHT - MARGIN.bottom);
  context.clip();
  for (const { hue, dash, angles, values } of traces) {
    context.strokeStyle = colour[hue];
    context.lineWidth = 1.7;
    context.setLineDash(dash);
    context.beginPath();
    // A canvas leaves out what is no number, and would join what lies beside it.
    angles.forEach((angle, k) => context[Number.isFinite(values[k - 1]) ? "lineTo" : "moveTo"](x(angle), y(values[k])));
    context.stroke();
  }
  context.setLineDash([]);
  context.fillStyle = colour.red;
  for (const [angle, one] of kind.marks ?? []) {
    context.beginPath();
    context.arc(x(angle), y(one), 2.4, 0, 2 * Math.PI);
    context.fill();
  }
  context.restore();
  const now = traces.map((trace) => trace.at(degrees));
  // The drawn angle may differ from that of the formula by whole turns.
  const turnsOff = (one, { angles, values }) => {
    const place = Math.max(0, angles.findIndex((angle) => angle >= degrees));
    return kind.fullTurn ? kind.fullTurn * Math.round((values[place] - one) / kind.fullTurn) : 0;
  };
  cursor(context, traces, now.map((one, i) => one + turnsOff(one, traces[i])), degrees, x, y, colour);
  const largest = Math.max(...span.map(Math.abs));
  const shown = (one) => number(Math.abs(one) < 1e-9 * largest ? 0 : one, 4);
  value.replaceChildren(
    ...traces.map(({ hue, label, marker }, i) =>
      el("span", { class: `hue-${hue}` }, marker ? glyph(marker) : "", `${label} ${shown(now[i])}`.trim()),
    ),
  );
  canvas.setAttribute(
    "aria-label",
    `${kind.title} over the input angle, ${number(span[0], 4)} to ${number(span[1], 4)} ${kind.unit}`,
  );
}

/** Drive stroke, marks, grid and ticks. */
function frame(context, x, y, motion, colour, width) {
  const [bottom, top] = y.range();
  context.fillStyle = colour.stroke;
  for (const [start, stop] of partsIn(x.domain(), motion?.stroke ?? motion?.dwell))
    context.fillRect(x(start), top, x(stop) - x(start), bottom - top);
  context.font = "10.5px system-ui, sans-serif";
  context.fillStyle = colour.muted;
  context.strokeStyle = colour.faint;
  context.lineWidth = 1;
  context.textAlign = "right";
  context.textBaseline = "middle";
  const ticks = y.ticks(4),
    text = tickText(ticks, 5);
  for (const tick of ticks) {
    const place = Math.round(y(tick)) + 0.5;
    context.beginPath();
    context.moveTo(MARGIN.left, place);
    context.lineTo(width - MARGIN.right, place);
    context.stroke();
    context.fillText(text(tick), MARGIN.left - 5, place);
  }
  context.textBaseline = "top";
  const [first, last] = x.domain();
  for (const angle of anglesOf([first, last], width > 190 ? 4 : 2, x)) {
    context.textAlign = angle === first ? "left" : angle === last ? "right" : "center";
    context.fillText(`${angle}°`.replace("-", "−"), x(angle), bottom + 5);
  }
  context.strokeStyle = colour.muted;
  context.setLineDash([1.5, 3]);
  for (const angle of Object.values(motion?.marks ?? {})) {
    const place = x(shownAngle(x.domain(), angle));
    context.beginPath();
    context.moveTo(place, top);
    context.lineTo(place, bottom);
    context.stroke();
  }
  context.setLineDash([]);
}

/** Lines at the study's bounds, over the input angles where they hold. */
function drawBounds(context, { bounds, factor }, motion, x, y, colour) {
  const [low, high] = y.domain();
  context.strokeStyle = colour.red;
  context.lineWidth = 1.2;
  context.setLineDash([7, 3, 2, 3]);
  for (const [, , bound, over] of bounds) {
    const value = factor * bound;
    if (value < low || value > high) continue;
    for (const [start, stop] of partsIn(x.domain(), typeof over === "string" ? strokeOf(motion, over) : over)) {
      context.beginPath();
      context.moveTo(x(start), y(value));
      context.lineTo(x(stop), y(value));
      context.stroke();
    }
  }
  context.setLineDash([]);
}

/** Input angles that are written at the axis: quarters or halves of a turn, or round ones of a part of it. */
const anglesOf = (span, count, x) =>
  isTurn(span) ? Array.from({ length: count + 1 }, (_, k) => (k * 360) / count) : x.ticks(count);

function cursor(context, traces, now, degrees, x, y, colour) {
  const [bottom, top] = y.range();
  context.strokeStyle = colour.ink;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(x(degrees), top);
  context.lineTo(x(degrees), bottom);
  context.stroke();
  context.strokeStyle = colour.panel;
  traces.forEach(({ hue, marker }, i) => {
    if (!Number.isFinite(now[i]) || y(now[i]) < 0) return;
    context.fillStyle = colour[hue];
    if (marker) return markAt(context, marker, x(degrees), y(now[i]), 0.9);
    context.beginPath();
    context.arc(x(degrees), y(now[i]), 3.2, 0, 2 * Math.PI);
    context.fill();
  });
}
