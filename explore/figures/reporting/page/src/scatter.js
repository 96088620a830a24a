/** The scatter of two columns: marks, strips for undefined values, a brush, the design under the pointer. */

import { brush } from "d3-brush";
import { pointer, select } from "d3-selection";
import { drawAxes } from "./axes.js";
import { check, choice, el, oncePerFrame, onWidth, resizeCanvas, svg } from "./dom.js";
import { legendOf, omissionText } from "./captions.js";
import { shortBound } from "./conditions.js";
import { RESULTS } from "./files.js";
import { titled } from "./format.js";
import { drawDensity } from "./density.js";
import { drawPoints, place } from "./points.js";
import { glyph } from "./marks.js";
import { axisScale, extent } from "./scales.js";
import { colours, onTheme } from "./theme.js";
import { isMove, zoomTool } from "./zoom.js";

const HEIGHT = 450;
const MARGIN = { left: 62, right: 14, top: 10, bottom: 46 };
/** Width of the strips for designs that are undefined in one of the two columns. */
const GUTTER = 22;
/** Largest distance between pointer and mark, pixels. */
const REACH = 12;

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {{selection: Object, hover: Object, chosen: Object, tip: Object}} shared
 */
export function scatter(root, model, shared) {
  const view = { ...firstAxes(model), colour: model.study.files ? RESULTS : "", logX: false, logY: false, all: false, zoom: null, width: 0, height: HEIGHT };
  const canvas = el("canvas", {}),
    overlay = svg("svg", { role: "group", tabindex: 0 });
  const plot = el("div", { class: "plot" }, canvas, overlay);
  const controls = el("div", { class: "controls" }),
    caption = el("p", { class: "caption" });
  const legend = el("div", { class: "legend" });
  root.append(el("div", { class: "panel-head" }, el("h2", {}, "Trade-off"), controls), plot, legend, caption);
  const layers = Object.fromEntries(
    ["x", "y", "brush", "focus"].map((name) => [name, select(overlay).append("g").attr("class", name)]),
  );
  const clip = svg("rect");
  const clipPath = svg("clipPath", { id: "scatter-clip" });
  clipPath.append(clip);
  overlay.append(clipPath);
  layers.brush.attr("clip-path", "url(#scatter-clip)");
  const tool = brush()
    .filter((event) => !isMove(event) && !event.ctrlKey && !event.metaKey && !event.button)
    .on("brush end", brushed);
  const zoom = zoomTool(view, overlay, layout, () => boxOf(shared.selection.brushes.get("scatter"), view));
  let points = null;

  /** Without box and zoom, which are of the axes before. */
  function startAnew() {
    view.zoom = null;
    shared.selection.set("scatter", []);
  }

  function listControls() {
    const options = model.columns.map((column) => [column.name, titled(column)]);
    const pick = (key) => (value) => {
      view[key] = value;
      if (key !== "colour") startAnew();
      listControls();
      layout();
    };
    const positive = (name) => extent(model.byName.get(name), model.kinds, { log: true, all: true }) !== null;
    const log = (key, name) =>
      check(
        "log",
        view[key],
        (value) => {
          view[key] = value;
          startAnew();
          layout();
        },
        !positive(name),
      );
    controls.replaceChildren(
      choice("x", options, view.x, pick("x")),
      log("logX", view.x),
      choice("y", options, view.y, pick("y")),
      log("logY", view.y),
      choice("colour", [["", "kind of design"], ...options], view.colour, pick("colour")),
      check("outliers", view.all, (value) => {
        view.all = value;
        startAnew();
        layout();
      }),
      zoom.node,
    );
  }

  function layout() {
    if (!view.width) return;
    const [x, y] = [model.byName.get(view.x), model.byName.get(view.y)];
    if (view.logX && !extent(x, model.kinds, { log: true, all: true })) view.logX = false;
    if (view.logY && !extent(y, model.kinds, { log: true, all: true })) view.logY = false;
    const spans = [
      extent(x, model.kinds, { log: view.logX, all: view.all }),
      extent(y, model.kinds, { log: view.logY, all: view.all }),
    ];
    const missing = undefinedIn(x, y, view);
    const ends = [view.width - MARGIN.right, HEIGHT - MARGIN.bottom];
    view.left = MARGIN.left + (missing.x ? GUTTER : 0);
    view.low = ends[1] - (missing.y ? GUTTER : 0);
    view.baseX = axisScale(spans[0] ?? [0, 1], [view.left, ends[0]], { log: view.logX, room: 0.035 });
    view.baseY = axisScale(spans[1] ?? [0, 1], [view.low, MARGIN.top], { log: view.logY, room: 0.035 });
    view.scaleX = view.zoom?.x ? view.baseX.copy().domain(view.zoom.x) : view.baseX;
    view.scaleY = view.zoom?.y ? view.baseY.copy().domain(view.zoom.y) : view.baseY;
    zoom.refresh();
    for (const [name, value] of Object.entries({
      width: view.width,
      height: HEIGHT,
      viewBox: `0 0 ${view.width} ${HEIGHT}`,
    }))
      overlay.setAttribute(name, value);
    overlay.setAttribute(
      "aria-label",
      `designs over ${titled(x)} and ${titled(y)}; + and - zoom, arrow keys move, 0 shows all`,
    );
    points = place(model, view, MARGIN.left + GUTTER / 2, ends[1] - GUTTER / 2);
    drawAxes(layers, view, MARGIN, [x, y], spans);
    tool.extent([
      [view.left, MARGIN.top],
      [ends[0], view.low],
    ]);
    const [width, height] = [ends[0] - view.left, view.low - MARGIN.top];
    for (const [name, value] of Object.entries({ x: view.left, y: MARGIN.top, width, height })) clip.setAttribute(name, value);
    layers.brush.call(tool).call(tool.move, boxOf(shared.selection.brushes.get("scatter"), view));
    layers.brush.select(".overlay").attr("aria-label", "drag to select designs");
    draw();
  }

  function draw() {
    if (!points) return;
    const context = resizeCanvas(canvas, view.width, HEIGHT);
    context.fillStyle = colours().faint;
    if (points.missingX) context.fillRect(MARGIN.left, MARGIN.top, GUTTER - 6, view.low - MARGIN.top);
    if (points.missingY) context.fillRect(view.left, view.low + 6, view.width - MARGIN.right - view.left, GUTTER - 6);
    const density = drawDensity(context, model, view);
    drawPoints(context, model, view, points, shared.selection);
    legendOf(legend, model, view, density);
    caption.textContent = omissionText(points, view, density, model);
    focus();
  }

  /** The markers of pinned designs, the chosen design's star and a ring around the one pointed at. */
  function focus() {
    if (!points) return;
    const marks = [];
    if (shared.hover.row >= 0) marks.push(["circle", shared.hover.row]);
    if (shared.chosen.row >= 0) marks.push(["star", shared.chosen.row]);
    layers.focus.selectAll("*").remove();
    for (const row of shared.pins.rows) {
      const { hue, marker } = shared.pins.lookOf(row);
      if (row === shared.chosen.row || Number.isNaN(points.x[row])) continue;
      layers.focus
        .append("g")
        .attr("transform", `translate(${points.x[row]},${points.y[row]}) scale(1.5)`)
        .attr("class", `hue-${hue}`)
        .node()
        .append(glyph(marker).querySelector("path"));
    }
    for (const [shape, row] of marks) {
      const [x, y] = [points.x[row], points.y[row]];
      if (Number.isNaN(x) || Number.isNaN(y)) continue;
      if (shape === "circle")
        layers.focus.append("circle").attr("cx", x).attr("cy", y).attr("r", 7).attr("class", "pointed");
      else
        layers.focus
          .append("g")
          .attr("transform", `translate(${x},${y}) scale(1.5)`)
          .node()
          .append(glyph("chosen").querySelector("path"));
    }
  }

  function brushed({ selection: box, sourceEvent }) {
    if (!sourceEvent) return;
    if (!box) return shared.selection.set("scatter", []);
    const [[x0, y0], [x1, y1]] = box;
    shared.selection.set("scatter", [interval(view.x, view.scaleX, x0, x1), interval(view.y, view.scaleY, y1, y0)]);
  }

  /** Nearest mark in reach, better kinds first, or -1. */
  function nearest(x, y) {
    let best = -1,
      least = REACH * REACH;
    for (let row = 0; row < model.size; row++) {
      const dx = points.x[row] - x,
        dy = points.y[row] - y;
      // A Pareto-optimal design is easier to catch than one that it lies on.
      const distance = dx * dx + dy * dy - 6 * model.kinds[row];
      if (distance < least) {
        least = distance;
        best = row;
      }
    }
    return best;
  }

  const point = oncePerFrame((event) => {
    if (event.buttons || !points) return;
    const row = nearest(...pointer(event, overlay));
    shared.hover.set(row);
    if (row >= 0) shared.tip.show(row, event.clientX, event.clientY);
    else shared.tip.hide();
  });
  let pressed = null;
  overlay.addEventListener("pointermove", point);
  overlay.addEventListener("pointerleave", () => {
    shared.hover.set(-1);
    shared.tip.hide();
  });
  overlay.addEventListener(
    "pointerdown",
    (event) => {
      shared.tip.hide();
      pressed = [event.clientX, event.clientY];
    },
    true,
  );
  overlay.addEventListener("click", (event) => {
    if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 3) return;
    const row = nearest(...pointer(event, overlay));
    shared.tip.hide();
    if (row >= 0) shared.chosen.set(row);
  });
  shared.selection.listen(
    oncePerFrame((selection) => {
      if (!selection.brushes.has("scatter")) layers.brush.call(tool.move, null);
      draw();
    }),
  );
  shared.hover.listen(focus);
  shared.chosen.listen(focus);
  shared.pins.listen(focus);
  onTheme(() => {
    layout();
  });
  listControls();
  onWidth(plot, (width) => {
    view.width = width;
    layout();
  });
  return { whereIs: (row) => [points.x[row], points.y[row]] };
}

/** The first two objectives, else the first two columns of numbers that differ between designs. */
function firstAxes(model) {
  const varying = model.columns.filter((column) => !column.labels && ["metric", "parameter"].includes(column.role));
  const names = [
    ...new Set([
      ...model.study.objectives.map(([name]) => name),
      ...varying.map((column) => column.name),
      ...model.columns.map((column) => column.name),
    ]),
  ];
  return { x: names[0], y: names[1] ?? names[0] };
}

/** Whether some design is undefined in only one of two columns and needs a strip. */
function undefinedIn(x, y, view) {
  const shown = (value, log) => Number.isFinite(value) && (!log || value > 0);
  const found = { x: false, y: false };
  for (let row = 0; row < x.values.length; row++) {
    const [inX, inY] = [shown(x.values[row], view.logX), shown(y.values[row], view.logY)];
    found.x ||= !inX && inY;
    found.y ||= inX && !inY;
  }
  return found;
}

/** Pixels of the box that was dragged, after the axes have moved; null when there is none. */
function boxOf(conditions, view) {
  if (!conditions) return null;
  const [x, y] = conditions;
  return [
    [view.scaleX(x.low), view.scaleY(y.high)],
    [view.scaleX(x.high), view.scaleY(y.low)],
  ];
}

/** The interval of an axis in short numbers. */
function interval(column, scale, from, to) {
  const low = scale.invert(from),
    high = scale.invert(to);
  const pixel = (at, value) => Math.abs(scale.invert(at + 1) - value);
  return { column, low: shortBound(low, pixel(from, low), false), high: shortBound(high, pixel(to, high), true) };
}
