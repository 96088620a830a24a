/** Density of two columns over all designs, with the Pareto-optimal ones; few designs in a window are drawn one by one. */

import { select } from "d3-selection";
import { drawAxes } from "../../../figures/reporting/page/src/axes.js";
import { choice, el, onWidth, resizeCanvas, svg } from "../../../figures/reporting/page/src/dom.js";
import { FILE_LOOKS } from "../../../figures/reporting/page/src/files.js";
import { count, titled } from "../../../figures/reporting/page/src/format.js";
import { mark } from "../../../figures/reporting/page/src/marks.js";
import { FEASIBLE, FRONT } from "../../../figures/reporting/page/src/payload.js";
import { axisScale } from "../../../figures/reporting/page/src/scales.js";
import { colours } from "../../../figures/reporting/page/src/theme.js";
import { drawCells } from "./cells.js";
import { query } from "./sources.js";
import { zoomable } from "./zooming.js";

/** Designs that are drawn one by one, at most. */
const MOST_POINTS = 2000;
const MARGIN = { left: 84, right: 12, top: 10, bottom: 46 };
/** Share of the axes beyond the designs. */
const ROOM = 0.02;
/** Pixels from a mark within which a click chooses it. */
const NEAR = 10;

/**
 * @param {HTMLElement} root
 * @param {Array<Object>} sources
 * @param {import("./conditions.js").Conditions} conditions
 * @param {(source: number, design: number, kind: number) => void} choose
 * @param {() => void} refresh called when the axes have changed
 */
export function cloud(root, sources, conditions, choose, refresh) {
  const [first] = sources;
  const aims = first.objectives.map((text) => text.split(":")[0]).filter((name) => first.byName.has(name));
  const metrics = [...aims, ...first.columns.filter(({ kind }) => kind === "metric").map(({ name }) => name), ...first.byName.keys()];
  const common = first.columns.filter(({ name }) => sources.every(({ byName }) => byName.has(name)));
  const [x, y] = [...new Set(metrics)].filter((name) => common.some((column) => column.name === name));
  const view = { x, y: y ?? x, window: null, width: 0, height: 0 };
  const axis = (side) =>
    choice(side, common.map((column) => [column.name, titled(column)]), view[side], (name) => {
      view[side] = name;
      view.window = null;
      refresh();
    });
  const canvas = el("canvas", { tabindex: 0, role: "img" });
  const frame = svg("svg");
  const [axisX, axisY] = [svg("g"), svg("g")];
  frame.append(axisX, axisY);
  const plot = el("div", { class: "plot" }, canvas, frame);
  const caption = el("p", { class: "caption", role: "status" });
  const zoom = zoomable(canvas, view, MARGIN, (window) => {
    view.window = window;
    refresh();
  });
  root.append(
    el("div", { class: "panel-head" }, el("h2", {}, "Trade-off"), el("div", { class: "controls" }, axis("x"), axis("y"), ...zoom.buttons)),
    plot,
    caption,
  );
  let [answers, points, fronts, marks] = [[], [], [], []];

  function draw() {
    if (!view.width || !answers.length) return;
    const [own, context] = [colours(), resizeCanvas(canvas, view.width, view.height)];
    const reach = ["x", "y"].map((side) => [
      Math.min(...answers.map((answer) => answer[side].low)),
      Math.max(...answers.map((answer) => answer[side].high)),
    ]);
    view.scaleX = axisScale(reach[0], [MARGIN.left, view.width - MARGIN.right], { room: ROOM });
    view.scaleY = axisScale(reach[1], [view.height - MARGIN.bottom, MARGIN.top], { room: ROOM });
    view.left = MARGIN.left;
    const columns = [view.x, view.y].map((name) => ({ ...first.byName.get(name), labels: null, role: "metric" }));
    drawAxes({ x: select(axisX), y: select(axisY) }, view, MARGIN, columns, reach);
    marks = [];
    context.save();
    context.beginPath();
    context.rect(MARGIN.left, MARGIN.top, view.width - MARGIN.left - MARGIN.right, view.height - MARGIN.top - MARGIN.bottom);
    context.clip();
    answers.forEach((answer, k) => {
      const hue = sources.length > 1 ? own[FILE_LOOKS[k].hue] : own.blue;
      if (sources.length === 1) drawCells(context, view, answer, answer.all, own.muted, 0.28);
      if (points[k]) drawMarks(context, FEASIBLE, points[k].map((one) => [k, ...one]), hue);
      else drawCells(context, view, answer, answer.counts, hue, sources.length > 1 ? 0.6 : 0.95);
    });
    fronts.forEach((front, k) => {
      const hue = sources.length > 1 ? own[FILE_LOOKS[k].hue] : own.orange;
      const places = front.designs.map((design) => [k, design.design, front.value(design, view.x), front.value(design, view.y)]);
      drawMarks(context, FRONT, places.filter(([, , a, b]) => Number.isFinite(a) && Number.isFinite(b)), hue);
    });
    context.restore();
    const shown = answers.reduce((sum, answer) => sum + answer.shown, 0);
    const how = !shown ? "" : points.some(Boolean) ? ", drawn one by one; click one" : "; darker where there are more; zoom in until they are drawn one by one";
    const [drawn, found] = [fronts.reduce((sum, { designs }) => sum + designs.length, 0), fronts.reduce((sum, front) => sum + front.found, 0)];
    const rings = !drawn ? "" : drawn < found ? ` Rings are the best ${count(drawn)} of ${count(found)} Pareto-optimal designs.` : " Rings are Pareto-optimal.";
    caption.textContent = `${shown ? count(shown) : "No"} selected designs in this window${how}.${rings}`;
    canvas.setAttribute("aria-label", `density of ${view.y} over ${view.x}: ${caption.textContent}`);
  }

  function drawMarks(context, kind, places, hue) {
    context.lineWidth = 1.6;
    context.strokeStyle = hue;
    for (const [source, design, a, b] of places) {
      context.fillStyle = kind === FRONT ? colours().panel : hue;
      const [left, top] = [view.scaleX(a), view.scaleY(b)];
      mark(context, kind, left, top, kind === FRONT ? 3.6 : 2);
      marks.push([left, top, source, design, kind]);
    }
  }

  canvas.onclick = ({ offsetX, offsetY }) => {
    const distance = ([left, top]) => Math.hypot(left - offsetX, top - offsetY);
    const nearest = marks.reduce((best, one) => (!best || distance(one) < distance(best) ? one : best), null);
    if (nearest && distance(nearest) < NEAR && !zoom.wasDragged()) choose(nearest[2], nearest[3], nearest[4]);
  };
  onWidth(plot, (width) => {
    Object.assign(view, { width, height: Math.round(Math.min(460, Math.max(280, width * 0.62))) });
    plot.style.height = `${view.height}px`;
    frame.setAttribute("width", width);
    frame.setAttribute("height", view.height);
    draw();
  });
  return {
    async read() {
      const { x, y, window } = view;
      const ends = window ? { x_low: window.x[0], x_high: window.x[1], y_low: window.y[0], y_high: window.y[1] } : commonEnds(sources, x, y);
      const told = await Promise.all(
        sources.map(async (one) => {
          const asked = { x, y, where: conditions.texts(one), ...ends };
          const answer = await query(one, "density", asked);
          const few = answer.shown <= MOST_POINTS ? await query(one, "points", { ...asked, limit: MOST_POINTS }) : { points: null };
          return [answer, few.points];
        }),
      );
      [answers, points] = [told.map(([answer]) => answer), told.map(([, few]) => few)];
    },
    draw,
    showFronts(now) {
      fronts = now;
      draw();
    },
  };
}

/** Ends of the axes that hold all designs of several results; none for one, whose own they are. */
function commonEnds(sources, x, y) {
  if (sources.length === 1) return {};
  const all = (name, side) => sources.map(({ byName }) => byName.get(name)[side]);
  return {
    x_low: Math.min(...all(x, "low")),
    x_high: Math.max(...all(x, "high")),
    y_low: Math.min(...all(y, "low")),
    y_high: Math.max(...all(y, "high")),
  };
}
