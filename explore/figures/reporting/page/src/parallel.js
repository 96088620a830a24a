/** Parallel coordinates: one line per design, one axis with a brush per column. */

import { axisLeft } from "d3-axis";
import { brushY } from "d3-brush";
import { select } from "d3-selection";
import { fileNames, rampItem } from "./captions.js";
import { shortBound } from "./conditions.js";
import { check, choice, el, oncePerFrame, onWidth, resizeCanvas, svg } from "./dom.js";
import { count, titled, words } from "./format.js";
import { fileColours, isByFile } from "./files.js";
import { headings } from "./headings.js";
import { QUICK, chooseLines, drawLines, shuffledRows } from "./lines.js";
import { LOOKS } from "./pins.js";
import { axisScale, extent, tickMarks } from "./scales.js";
import { shading } from "./shading.js";
import { colours, onTheme } from "./theme.js";

/** Milliseconds without movement after which a brush counts as at rest. */
const STILL = 120;
/** Height of the axes and of the strip below them for undefined values. */
const AXIS = 278,
  GUTTER = 24;
const MARGIN = { left: 56, right: 40, bottom: 10 };
const USUAL_AXES = 10;
/** Smallest distance between axes, pixels; a narrower page scrolls, which leaves room for the headings. */
const LEAST_STEP = 68,
  SCROLLED_STEP = 84;

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {{selection: Object, hover: Object, chosen: Object}} shared
 */
export function parallel(root, model, shared) {
  const view = { names: firstAxes(model), colour: "", room: 0, width: 0, top: 0, height: 0, axes: [] };
  const canvas = el("canvas", {}),
    overlay = svg("svg", { role: "group", "aria-label": "axes to brush" });
  const chosen = svg("polyline", { class: "line chosen-line" }),
    pointed = svg("polyline", { class: "line pointed-line" });
  const pinned = LOOKS.map(({ hue, dash }) =>
    svg("polyline", { class: `line pinned-line hue-${hue}`, "stroke-dasharray": dash.join(" ") }),
  );
  overlay.append(...pinned, chosen, pointed);
  const labels = el("div", { class: "axis-labels", role: "group", "aria-label": "axes in their order" });
  const titles = headings(labels, model, move);
  const plot = el("div", { class: "plot" }, canvas, overlay, labels),
    frame = el("div", { class: "sideways" }, plot);
  const caption = el("p", { class: "caption" }),
    legend = el("div", { class: "legend" }),
    status = el("p", { class: "unseen", role: "status" });
  root.append(
    el("div", { class: "panel-head" }, el("h2", {}, "Parallel coordinates"), controls()),
    frame,
    legend,
    caption,
    status,
  );
  const order = shuffledRows(model);
  let later = 0;

  function controls() {
    const boxes = model.columns.map((column) =>
      check(words(column.name), view.names.includes(column.name), (on) => {
        view.names = on ? [...view.names, column.name] : view.names.filter((name) => name !== column.name);
        layout();
      }),
    );
    const options = model.columns.map((column) => [column.name, titled(column)]);
    return el(
      "div",
      { class: "controls" },
      choice("colour", [["", "kind of design"], ...options], "", (name) => {
        view.colour = name;
        draw();
      }),
      el("details", { class: "menu" }, el("summary", {}, "Axes"), el("div", { class: "menu-list" }, ...boxes)),
    );
  }

  /** Let an axis stand at another place among the others. */
  function move(name, place) {
    if (place < 0 || place >= view.names.length) return;
    view.names = view.names.filter((other) => other !== name);
    view.names.splice(place, 0, name);
    status.textContent = `${words(name)} is axis ${place + 1} of ${view.names.length}`;
    layout(QUICK);
  }

  function layout(share = 1) {
    if (!view.room) return;
    const step = stepOf(view.room, view.names.length);
    view.width = Math.max(view.room, MARGIN.left + MARGIN.right + step * (view.names.length - 1));
    plot.style.width = `${view.width}px`;
    const places = view.names.map((name, k) => ({ column: model.byName.get(name), x: MARGIN.left + k * step }));
    view.top = titles.place(places, step, view.width) + 10;
    view.height = view.top + AXIS + MARGIN.bottom;
    titles.stand((view.top - 8) / view.height);
    for (const [name, value] of Object.entries({
      width: view.width,
      height: view.height,
      viewBox: `0 0 ${view.width} ${view.height}`,
    }))
      overlay.setAttribute(name, value);
    view.axes = places.map(({ column, x }) => {
      const span = extent(column, model.kinds, { log: false, all: false });
      const scale = axisScale(span ?? [0, 1], [view.height - MARGIN.bottom - GUTTER, view.top]);
      return { column, span, scale, x };
    });
    drawAxes();
    draw(share);
  }

  function drawAxes() {
    const groups = select(overlay)
      .selectAll("g.dimension")
      .data(view.axes, ({ column }) => column.name)
      .join("g")
      .attr("class", "dimension")
      .attr("transform", ({ x }) => `translate(${x},0)`);
    groups.each(function draw({ column, span, scale }) {
      const group = select(this);
      group.selectAll("*").remove();
      const { values, text } = tickMarks(scale, column, 5, span);
      group.append("g").attr("class", "axis").call(axisLeft(scale).tickValues(values).tickFormat(text).tickSize(4));
      const [bottom, top] = scale.range();
      const tool = brushY()
        .extent([
          [-11, top],
          [11, bottom],
        ])
        .on("brush end", (event) => brushed(column.name, scale, event));
      const layer = group.append("g").attr("class", "brush").call(tool);
      const known = shared.selection.brushes.get(`axis:${column.name}`)?.[0];
      if (known)
        layer.call(tool.move, [
          known.high === Infinity ? top : clamp(scale, known.high),
          known.low === -Infinity ? bottom : clamp(scale, known.low),
        ]);
    });
  }

  function brushed(name, scale, { selection: span, sourceEvent }) {
    if (!sourceEvent) return;
    if (!span) return shared.selection.set(`axis:${name}`, []);
    const [bottom, top] = scale.range();
    const bound = (at, up) => {
      const value = scale.invert(at);
      return shortBound(value, Math.abs(scale.invert(at + 1) - value), up);
    };
    // At the ends of an axis lie the values beyond it too.
    const low = span[1] >= bottom - 0.5 ? -Infinity : bound(span[1], false);
    const high = span[0] <= top + 0.5 ? Infinity : bound(span[0], true);
    const whole = low === -Infinity && high === Infinity;
    shared.selection.set(`axis:${name}`, [{ column: name, low: whole ? -Number.MAX_VALUE : low, high }]);
  }

  const undefinedAt = () => view.height - MARGIN.bottom - GUTTER / 2 + 4;

  /** Heights of a design on all axes; what lies beyond an end runs to it, what is undefined into the strip. */
  const heights = (row) =>
    view.axes.map(({ column, scale }) => {
      const value = column.values[row];
      return Number.isFinite(value) ? clamp(scale, value) : undefinedAt();
    });

  function draw(share = 1) {
    clearTimeout(later);
    if (share < 1) later = setTimeout(draw, STILL);
    const rows = chooseLines(model, order, shared.selection, share);
    const context = resizeCanvas(canvas, view.width, view.height);
    strip(context);
    const shades = view.colour ? shadesOf(model, view.colour, rows.selected) : null;
    // Along the strip of undefined values all lines would lie on each other: they would be the strongest of all.
    const trace = (row) =>
      heights(row).forEach((y, k, ys) => {
        const along = y === undefinedAt() && ys[k - 1] === y;
        context[along ? "moveTo" : "lineTo"](view.axes[k].x, y);
      });
    drawLines(context, model.kinds, rows, trace, shades?.of);
    const items = isByFile(model, view.colour) ? fileNames(model) : [];
    legend.replaceChildren(...(shades && !items.length ? [rampItem(shades, model.byName.get(view.colour))] : items));
    const total = shared.selection.total;
    const some = rows.selected.length < total ? ", Pareto-optimal ones first, an even sample of the others" : "";
    caption.textContent = `${count(rows.selected.length)} of ${count(total)} selected designs are drawn${some}; drag along an axis to select, drag a heading to move its axis.`;
    focus();
  }

  /** Where undefined values go. */
  function strip(context) {
    const colour = colours(),
      top = view.height - MARGIN.bottom - GUTTER + 8;
    context.fillStyle = colour.faint;
    context.fillRect(MARGIN.left - 12, top, view.width - MARGIN.left - MARGIN.right + 24, GUTTER - 8);
    context.fillStyle = colour.muted;
    context.font = "10.5px system-ui, sans-serif";
    context.textBaseline = "middle";
    context.fillText("undefined", MARGIN.left - 8, undefinedAt());
  }

  /** The pinned designs, the chosen one and the one pointed at, over all others. */
  function focus() {
    if (!view.width) return;
    for (const [node, row] of [
      ...shared.pins.slots.map((row, k) => [pinned[k], row]),
      [chosen, shared.chosen.row],
      [pointed, shared.hover.row],
    ]) {
      const ys = row < 0 ? [] : heights(row);
      node.setAttribute("points", ys.map((y, k) => `${view.axes[k].x},${y}`).join(" "));
    }
  }

  shared.selection.listen(
    oncePerFrame((selection) => {
      for (const group of overlay.querySelectorAll("g.dimension")) {
        const layer = group.querySelector("g.brush"),
          name = group.__data__.column.name;
        if (!selection.brushes.has(`axis:${name}`)) select(layer).call(brushY().move, null);
      }
      draw(QUICK);
    }),
  );
  shared.hover.listen(oncePerFrame(focus));
  shared.chosen.listen(focus);
  shared.pins.listen(focus);
  onTheme(() => {
    if (view.width) {
      draw();
    }
  });
  onWidth(frame, (width) => {
    view.room = width;
    layout();
  });
  return {
    refresh: () => {
      if (view.width) drawAxes();
    },
  };
}

const clamp = (scale, value) => {
  const [bottom, top] = scale.range();
  return Math.max(top, Math.min(bottom, scale(value)));
};

/** Parameters that vary, objectives and constrained metrics; others can be added. */
function firstAxes(model) {
  const aims = new Set([...model.study.objectives.map(([name]) => name), ...model.study.missed.map(([name]) => name)]);
  const varies = ({ values }) => values.some((value) => value !== values[0] && Number.isFinite(value));
  const parameters = model.columns.filter((column) => column.role === "parameter" && varies(column));
  const metrics = model.columns.filter((column) => column.role === "metric" && !column.labels);
  const objective = ({ name }) => model.study.objectives.some(([metric]) => metric === name);
  const rank = (column) => (objective(column) ? 0 : aims.has(column.name) ? 1 : 2);
  const wanted = [
    ...metrics.filter(objective),
    ...parameters,
    ...metrics.filter((c) => !objective(c)).sort((a, b) => rank(a) - rank(b)),
  ];
  const names = new Set(wanted.slice(0, Math.max(2, USUAL_AXES)).map((column) => column.name));
  return model.columns.map((column) => column.name).filter((name) => names.has(name));
}

/** Colours by a column; the scale spans the best kind of design among the drawn lines. */
function shadesOf(model, name, rows) {
  if (isByFile(model, name)) return { of: fileColours(model) };
  const { values } = model.byName.get(name);
  const known = rows.filter((row) => Number.isFinite(values[row]));
  const best = known.reduce((kind, row) => Math.max(kind, model.kinds[row]), 0);
  const shown = known.filter((row) => model.kinds[row] === best).map((row) => values[row]);
  return shading(values, shown.length ? [Math.min(...shown), Math.max(...shown)] : null);
}

/** Pixels from axis to axis; where the page scrolls, the last visible heading is complete. */
function stepOf(room, axes) {
  const whole = (room - MARGIN.left - MARGIN.right) / Math.max(1, axes - 1);
  if (whole >= LEAST_STEP) return whole;
  const inSight = Math.max(1, Math.floor((room - MARGIN.left) / SCROLLED_STEP + 0.5));
  return (room - MARGIN.left) / (inSight - 0.5);
}
