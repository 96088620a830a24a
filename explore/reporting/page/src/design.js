/** The chosen design: its mechanism in motion, its curves, its values. */

import { el, onWidth, resizeCanvas } from "./dom.js";
import { cell, count, words } from "./format.js";
import { curveChart } from "./curves.js";
import { KINDS, glyph } from "./marks.js";
import { DASHES, HUES, drawMechanism, drawingOf, heightOf, limitsOf } from "./drawing.js";
import { brokenParameter, hasMotion, motionOf, overTheTurn } from "./mechanism.js";
import { panelsOf } from "./panels.js";
import { onTheme } from "./theme.js";

/** Seconds of a turn on the screen, whatever the speed of the mechanism. */
const TURN = 5;

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {import("./selection.js").Focus} chosen
 */
export function designPanel(root, model, chosen) {
  const state = { degrees: 0, playing: false, motion: null, turn: null, drawing: null, size: { width: 0, height: 0 } };
  const canvas = el("canvas", { class: "picture", role: "img" });
  const stage = el("div", { class: "stage" }, canvas);
  const controls = player(state, model.study.motion?.input ?? "input angle", () => draw());
  const curves = el("div", { class: "curves" });
  const head = el("div", { class: "panel-head" });
  const message = el("p", { class: "message", hidden: true });
  const legend = el("p", { class: "legend small" });
  const values = el("div", { class: "values" });
  root.append(
    head,
    message,
    el("div", { class: "motion" }, el("div", {}, stage, legend, controls.node), curves),
    values,
  );
  let charts = [];

  function show(row) {
    const parameters = parametersOf(model, row);
    const { motion: declared, drive } = model.study;
    state.motion = hasMotion(declared) ? motionOf(declared, parameters, drive) : null;
    state.turn = state.motion && overTheTurn(state.motion);
    state.drawing = state.motion && declared.drawing ? drawingOf(state.motion) : null;
    heading(head, model, row);
    listValues(values, model, row);
    const why = missingMotionReason(model, row, state.motion);
    message.hidden = !why;
    message.textContent = why;
    root.classList.toggle("still", !state.motion);
    legendOf(legend, state.drawing);
    stage.hidden = !state.drawing;
    if (!state.motion) return controls.pause();
    state.degrees = (((state.motion.stroke?.[0] ?? 0) % 360) + 360) % 360;
    canvas.setAttribute("aria-label", `the mechanism of design ${model.designs[row]} in true proportions`);
    charts = panelsOf(state.motion).map((kind) =>
      curveChart(kind, model.study.bounds, (degrees) => {
        controls.pause();
        controls.set(degrees);
      }),
    );
    curves.replaceChildren(...charts.map((chart) => chart.node));
    draw();
  }

  function draw() {
    controls.show();
    if (!state.motion) return;
    if (state.drawing && state.size.width) {
      state.size.height = heightOf(state.drawing, state.size.width);
      const context = resizeCanvas(canvas, state.size.width, state.size.height);
      drawMechanism(context, state.drawing, state.degrees, state.size);
    }
    const width = charts[0].node.clientWidth;
    for (const chart of charts) chart.draw(state.motion, state.turn, state.degrees, width);
  }

  onWidth(stage, (width) => {
    state.size.width = width;
    draw();
  });
  onTheme(draw);
  chosen.listen((row) => {
    show(row);
    if (state.motion && !matchMedia("(prefers-reduced-motion: reduce)").matches) controls.play();
  });
  if (chosen.row >= 0) show(chosen.row);
}

/** Play and pause, and the input angle as a slider. */
function player(state, angle, draw) {
  const button = el("button", { type: "button", class: "play", onclick: () => (state.playing ? pause() : play()) });
  const slider = el("input", {
    type: "range",
    min: 0,
    max: 360,
    step: 0.1,
    "aria-label": `${angle} in degrees`,
    oninput: () => {
      const degrees = Number(slider.value);
      pause();
      set(degrees);
    },
  });
  const reading = el("output", { class: "reading" });
  let before = 0;

  function frame(now) {
    if (!state.playing) return;
    if (before) state.degrees = (state.degrees + ((now - before) / 1000 / TURN) * 360) % 360;
    before = now;
    draw();
    requestAnimationFrame(frame);
  }
  function play() {
    if (state.playing || !state.motion) return;
    state.playing = true;
    before = 0;
    requestAnimationFrame(frame);
  }
  function pause() {
    state.playing = false;
    draw();
  }
  function set(degrees) {
    state.degrees = degrees;
    draw();
  }
  function show() {
    button.textContent = state.playing ? "❚❚ Pause" : "▶ Play";
    slider.value = state.degrees;
    reading.textContent = `${angle} ${state.degrees.toFixed(1)}°`;
  }
  return { node: el("div", { class: "player" }, button, slider, reading), play, pause, set, show };
}

/** Parameters of a design by name: the swept ones, and defaults of the mechanism for the others. */
export function parametersOf(model, row) {
  const swept = model.columns
    .filter((column) => column.role === "parameter")
    .map((column) => [column.name, column.values[row]]);
  return { ...model.study.defaults, ...Object.fromEntries(swept) };
}

function heading(head, model, row) {
  const kind = model.kinds[row];
  head.replaceChildren(
    el("h2", {}, glyph("chosen"), ` Design ${count(model.designs[row])}`),
    el("span", { class: "badge" }, glyph(kind), ` ${KINDS[kind].name}`),
  );
}

/** The reason why no motion is drawn; empty if one is. */
function missingMotionReason(model, row, motion) {
  if (motion) return "";
  if (!hasMotion(model.study.motion))
    return `This page has no drawing of the mechanism “${model.study.mechanism}”; its designs are shown in numbers.`;
  const { motion: declared, sentences } = model.study;
  const status = model.byName.get("status");
  const code = status?.values[row];
  const broken = brokenParameter(declared, parametersOf(model, row));
  if (broken && (!status || declared.moving.includes(code)))
    return `No full turn to draw: the value of ${words(broken)} is none that it can take.`;
  const label = status?.labels?.[code];
  const sentence = Object.hasOwn(sentences, label) ? sentences[label] : "this design does not turn";
  return `No full turn to draw: ${sentence}.`;
}

/** Name what is drawn. */
function legendOf(legend, drawn) {
  if (!drawn) return legend.replaceChildren();
  const { drawing, motion } = drawn;
  const item = (look, text) => el("span", { class: "item" }, el("i", { class: `swatch ${look}` }), text);
  const items = [...drawing.links, ...drawing.profiles].map(({ name }, k) => item(`hue-${HUES[k % HUES.length]}`, name));
  for (const path of drawing.paths) if (path.role === "point") items.push(item("point", path.long_name));
  if (motion.stroke) items.push(item("drive", "drive stroke"));
  limitsOf(motion).forEach(([name, angle], k) => {
    items.push(item(`limit-${k % DASHES.length}`, `${name} ${(((angle % 360) + 360) % 360).toFixed(1)}°`));
  });
  legend.replaceChildren(...items);
}

/** List the values of a design with units: parameters, objectives and constrained metrics first. */
function listValues(values, model, row) {
  const open = values.querySelector("details")?.open;
  const aims = new Set([...model.study.objectives, ...model.study.missed].map(([name]) => name));
  const matters = (column) => column.role === "parameter" || aims.has(column.name);
  const list = (columns) =>
    el(
      "dl",
      {},
      ...columns.map((column) =>
        el(
          "div",
          { title: column.meaning },
          el("dt", {}, words(column.name)),
          el(
            "dd",
            {},
            cell(column, column.values[row], 8),
            column.unit ? el("span", { class: "unit" }, ` ${column.unit}`) : "",
          ),
        ),
      ),
    );
  const others = model.columns.filter((column) => !matters(column));
  values.replaceChildren(
    list(model.columns.filter(matters)),
    el("details", { open }, el("summary", {}, `${others.length} more values`), list(others)),
  );
}
