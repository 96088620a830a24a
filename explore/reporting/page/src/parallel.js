/** Parallel coordinates: a line for a design, an axis for a column, a brush on each axis. */

import { axisLeft } from "d3-axis";
import { brushY } from "d3-brush";
import { select } from "d3-selection";
import { shortBound } from "./conditions.js";
import { check, el, framed, onWidth, sized, svg } from "./dom.js";
import { count, words } from "./format.js";
import { kindColour } from "./marks.js";
import { axisScale, extent, tickMarks } from "./scales.js";
import { colours, onTheme } from "./theme.js";

/** Lines that are drawn at most, and while a brush moves; of them the infeasible, and those that are not selected. */
const MOST = 5000,
  QUICK = 1000,
  MOST_INFEASIBLE = 400,
  MOST_OTHERS = 800;
/** Milliseconds after which a brush counts as still. */
const STILL = 120;
const HEIGHT = 350;
const MARGIN = { left: 56, right: 40, top: 62, bottom: 10 };
/** Height of the strip below the axes where undefined values go. */
const GUTTER = 24;
const USUAL_AXES = 10;
/** Pixels from axis to axis at least; a narrow page scrolls. */
const LEAST_STEP = 68;

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {{selection: Object, hover: Object, chosen: Object}} shared
 */
export function parallel(root, model, shared) {
  const view = { names: firstAxes(model), room: 0, width: 0, axes: [] };
  const canvas = el("canvas", {}),
    overlay = svg("svg", { role: "group", "aria-label": "axes to brush" });
  const chosen = svg("polyline", { class: "line chosen-line" }),
    pointed = svg("polyline", { class: "line pointed-line" });
  overlay.append(chosen, pointed);
  const labels = el("div", { class: "axis-labels", "aria-hidden": "true" });
  const plot = el("div", { class: "plot" }, canvas, overlay, labels),
    frame = el("div", { class: "sideways" }, plot);
  const caption = el("p", { class: "caption" });
  root.append(el("div", { class: "panel-head" }, el("h2", {}, "Parallel coordinates"), menu()), frame, caption);
  const order = shuffled(model);
  let later = 0;

  function menu() {
    const boxes = model.columns.map((column) =>
      check(words(column.name), view.names.includes(column.name), (on) => {
        view.names = on
          ? model.columns.map((c) => c.name).filter((name) => name === column.name || view.names.includes(name))
          : view.names.filter((name) => name !== column.name);
        layout();
      }),
    );
    return el("details", { class: "menu" }, el("summary", {}, "Axes"), el("div", { class: "menu-list" }, ...boxes));
  }

  function layout() {
    if (!view.room) return;
    view.width = Math.max(view.room, MARGIN.left + MARGIN.right + LEAST_STEP * (view.names.length - 1));
    plot.style.width = `${view.width}px`;
    for (const [name, value] of Object.entries({
      width: view.width,
      height: HEIGHT,
      viewBox: `0 0 ${view.width} ${HEIGHT}`,
    }))
      overlay.setAttribute(name, value);
    const room = view.width - MARGIN.left - MARGIN.right,
      last = Math.max(1, view.names.length - 1);
    const step = room / last;
    view.axes = view.names.map((name, k) => {
      const column = model.byName.get(name),
        span = extent(column, model.kinds, { log: false, all: false });
      const scale = axisScale(span ?? [0, 1], [HEIGHT - MARGIN.bottom - GUTTER, MARGIN.top]);
      return { column, span, scale, x: MARGIN.left + k * step };
    });
    labels.replaceChildren(
      ...view.axes.map(({ column, x }) =>
        el(
          "div",
          { title: column.meaning },
          words(column.name),
          column.unit ? el("span", { class: "unit" }, ` ${column.unit}`) : "",
        ),
      ),
    );
    view.axes.forEach(({ x }, k) => {
      const width = Math.min(step - 4, 130),
        node = labels.children[k].style;
      const left = Math.max(0, Math.min(view.width - width, x - width / 2));
      // In shares of the plot, which may be wider or narrower on paper.
      const share = (pixels, whole) => `${(100 * pixels) / whole}%`;
      const places = { left: share(left, view.width), width: share(width, view.width) };
      Object.assign(node, { ...places, height: share(MARGIN.top - 8, HEIGHT) });
    });
    drawAxes();
    draw();
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

  /** Heights of a design on all axes; what lies beyond an end runs to it, what is undefined into the strip. */
  const heights = (row) =>
    view.axes.map(({ column, scale }) => {
      const value = column.values[row];
      return Number.isFinite(value) ? clamp(scale, value) : HEIGHT - MARGIN.bottom - GUTTER / 2 + 4;
    });

  function line(context, row) {
    const ys = heights(row);
    context.beginPath();
    view.axes.forEach(({ x }, k) => context.lineTo(x, ys[k]));
    context.stroke();
  }

  function draw(most = MOST) {
    clearTimeout(later);
    if (most < MOST) later = setTimeout(draw, STILL);
    const { selected, others } = drawn(model, order, shared.selection, most);
    drawLines(sized(canvas, view.width, HEIGHT), selected, others);
    const total = shared.selection.total;
    const some = selected.length < total ? ", Pareto-optimal ones first, the others drawn evenly" : "";
    caption.textContent = `${count(selected.length)} of ${count(total)} selected designs are drawn${some}; drag along an axis to select.`;
    focus();
  }

  function drawLines(context, selected, others) {
    const colour = colours();
    context.fillStyle = colour.faint;
    context.fillRect(
      MARGIN.left - 12,
      HEIGHT - MARGIN.bottom - GUTTER + 8,
      view.width - MARGIN.left - MARGIN.right + 24,
      GUTTER - 8,
    );
    context.fillStyle = colour.muted;
    context.font = "10.5px system-ui, sans-serif";
    context.textBaseline = "middle";
    context.fillText("undefined", MARGIN.left - 8, HEIGHT - MARGIN.bottom - GUTTER / 2 + 4);
    context.lineWidth = 1;
    context.globalAlpha = 0.1;
    context.strokeStyle = colour.muted;
    for (const row of others) line(context, row);
    const totals = [0, 0, 0];
    for (const row of selected) totals[model.kinds[row]]++;
    for (const kind of [0, 1, 2]) {
      context.strokeStyle = kindColour(kind);
      context.lineWidth = kind === 2 ? 1.4 : 1;
      context.setLineDash(kind === 0 ? [3, 3] : []);
      context.globalAlpha = Math.min(0.8, Math.max(0.05, (kind === 2 ? 9 : 5) / Math.sqrt(totals[kind] + 1)));
      for (const row of selected) if (model.kinds[row] === kind) line(context, row);
    }
  }

  /** The chosen design and the one pointed at, over all others. */
  function focus() {
    if (!view.width) return;
    for (const [node, row] of [
      [chosen, shared.chosen.row],
      [pointed, shared.hover.row],
    ]) {
      const ys = row < 0 ? [] : heights(row);
      node.setAttribute("points", ys.map((y, k) => `${view.axes[k].x},${y}`).join(" "));
    }
  }

  shared.selection.listen(
    framed((selection) => {
      for (const group of overlay.querySelectorAll("g.dimension")) {
        const layer = group.querySelector("g.brush"),
          name = group.__data__.column.name;
        if (!selection.brushes.has(`axis:${name}`)) select(layer).call(brushY().move, null);
      }
      draw(QUICK);
    }),
  );
  shared.hover.listen(framed(focus));
  shared.chosen.listen(focus);
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

/** Rows in an order that has no order, the same each time, Pareto-optimal designs first. */
function shuffled(model) {
  const key = (row) => Math.imul(row + 1, 2654435761) >>> 0;
  return Uint32Array.from({ length: model.size }, (_, row) => row).sort(
    (a, b) => model.kinds[b] - model.kinds[a] || key(a) - key(b),
  );
}

/** The designs whose lines are drawn. */
function drawn(model, order, { mask, active }, most) {
  const selected = [],
    others = [],
    mostOthers = Math.min(MOST_OTHERS, most / 4);
  let infeasible = 0;
  for (const row of order) {
    if (mask[row]) {
      if (selected.length >= most - (active ? mostOthers : 0)) break;
      if (model.kinds[row] === 0 && infeasible++ >= MOST_INFEASIBLE) continue;
      selected.push(row);
    } else if (others.length < mostOthers && model.kinds[row] > 0) others.push(row);
  }
  return { selected, others };
}
