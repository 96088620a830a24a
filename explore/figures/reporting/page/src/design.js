/** The chosen design and those pinned for a comparison: mechanisms in motion, curves, values. */

import { el, onWidth, resizeCanvas } from "./dom.js";
import { curveChart } from "./curves.js";
import { DASHES, HUES, drawMechanism, drawingOf, heightOf, limitsOf, pointPaths } from "./drawing.js";
import { fileOf } from "./files.js";
import { designName, number, words } from "./format.js";
import { KINDS, dashedLine, glyph } from "./marks.js";
import { brokenParameter, hasMotion, motionOf, overTheMotion } from "./mechanism.js";
import { drawOverlay, jointReach } from "./overlay.js";
import { comparedPanels, panelsOf } from "./panels.js";
import { pinBoard } from "./pins.js";
import { advance, angleText, jointSpan, shownAngle } from "./span.js";
import { onTheme } from "./theme.js";
import { listValues } from "./values.js";

/**
 * @param {HTMLElement} root
 * @param {import("./payload.js").Model} model
 * @param {{chosen: import("./selection.js").Focus, pins: import("./pins.js").Pins}} shared
 */
export function designPanel(root, model, { chosen, pins }) {
  // `shown` has the designs with a motion.
  const state = { degrees: 0, isBack: false, span: [0, 360], playing: false, shown: [], isCompared: false, size: { width: 0, height: 0 } };
  const canvas = el("canvas", { class: "picture", role: "img" });
  const stage = el("div", { class: "stage" }, canvas);
  const controls = player(state, model.study.motion?.input ?? "input angle", () => draw());
  const board = pinBoard(model, pins, chosen);
  const curves = el("div", { class: "curves" });
  const title = el("h2", {}),
    badge = el("span", { class: "badge" });
  const message = el("p", { class: "message", hidden: true });
  const legend = el("p", { class: "legend small" });
  const values = el("div", { class: "values" });
  root.append(
    el("div", { class: "panel-head" }, title, badge, board.button),
    board.legend,
    board.status,
    message,
    el("div", { class: "motion" }, el("div", {}, stage, legend, controls.node), curves),
    values,
  );
  let charts = [];

  function show() {
    const row = chosen.row;
    const rows = pins.compared(row);
    state.isCompared = rows.length > 1;
    state.shown = rows.map((one) => movingDesign(model, one, pins.lookOf(one))).filter(({ motion }) => motion);
    title.replaceChildren(glyph("chosen"), ` Design ${designName(model, row)}`);
    badge.replaceChildren(glyph(model.kinds[row]), ` ${KINDS[model.kinds[row]].name}`);
    board.show();
    listValues(values, model, rows.map((one) => [one, pins.lookOf(one)]));
    const why = missingMotionReason(model, row, state.shown.find((one) => one.row === row));
    message.hidden = !why;
    message.textContent = why;
    root.classList.toggle("still", !state.shown.length);
    const drawn = state.shown.length && state.shown[0].drawing;
    legendOf(legend, state.isCompared ? null : drawn);
    stage.hidden = !drawn;
    if (!state.shown.length) return controls.pause();
    state.span = jointSpan(state.shown.map(({ motion }) => motion));
    // The designs shown before may have moved over more of a turn.
    if (state.degrees < state.span[0] || state.degrees > state.span[1]) state.degrees = startOf(state.shown[0].motion);
    const names = state.shown.map((one) => designName(model, one.row)).join(", ");
    canvas.setAttribute("aria-label", `the mechanism of design ${names} in true proportions`);
    const panels = state.isCompared ? comparedPanels(state.shown) : panelsOf(state.shown[0]);
    charts = panels.map((kind) =>
      curveChart(kind, state.span, model.study.bounds, (degrees) => {
        controls.pause();
        controls.set(degrees);
      }),
    );
    curves.replaceChildren(...charts.map((chart) => chart.node));
    draw();
  }

  function draw() {
    controls.show();
    if (!state.shown.length) return;
    const { shown, size } = state;
    if (shown[0].drawing && size.width) {
      size.height = heightOf({ reach: jointReach(shown.map(({ drawing }) => drawing)) }, size.width);
      const context = resizeCanvas(canvas, size.width, size.height);
      if (state.isCompared) drawOverlay(context, shown, state.degrees, size);
      else drawMechanism(context, shown[0].drawing, state.degrees, size);
    }
    const width = charts[0].node.clientWidth;
    for (const chart of charts) chart.draw(state.degrees, width);
  }

  onWidth(stage, (width) => {
    state.size.width = width;
    draw();
  });
  onTheme(draw);
  chosen.listen((row) => {
    show();
    const own = state.shown.find((one) => one.row === row);
    if (!own) return;
    state.degrees = startOf(own.motion);
    draw();
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) controls.play();
  });
  pins.listen(() => {
    if (chosen.row >= 0) show();
  });
  if (chosen.row < 0) return;
  show();
  if (state.shown.length) controls.set(startOf(state.shown[0].motion));
}

/** The motion of a design, null where it has none, with what is drawn of it. */
function movingDesign(model, row, look) {
  const { motion: declared } = model.study,
    { drive, target } = fileOf(model, row);
  const motion = hasMotion(declared) ? motionOf(declared, parametersOf(model, row), drive) : null;
  if (!motion) return { row, motion };
  return { row, look, motion, turn: overTheMotion(motion), drawing: declared.drawing ? drawingOf(motion, target) : null };
}

/** The input angle that is shown first: the start of the drive stroke, or of the motion. */
const startOf = ({ stroke, span }) => shownAngle(span, stroke?.[0] ?? span[0]);

/** Play and pause, and the input angle as a slider. */
function player(state, angle, draw) {
  const button = el("button", { type: "button", class: "play", onclick: () => (state.playing ? pause() : play()) });
  const slider = el("input", {
    type: "range",
    step: "any",
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
    if (before) advance(state, state.span, (now - before) / 1000);
    before = now;
    draw();
    requestAnimationFrame(frame);
  }
  function play() {
    if (state.playing || !state.shown.length) return;
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
    [slider.min, slider.max] = state.span;
    slider.value = state.degrees;
    reading.textContent = `${angle} ${angleText(state.degrees, 1)}`;
  }
  return { node: el("div", { class: "player" }, button, slider, reading), play, pause, set, show };
}

/** Parameters of a design by name, in declared units: the swept ones, those of its slider, and defaults for the others. */
export function parametersOf(model, row) {
  const tied = model.study.motion?.slider?.columns ?? [];
  const swept = model.columns
    .filter((column) => (column.role === "parameter" || tied.includes(column.name)) && !fileOf(model, row).lacks?.includes(column.name))
    .map((column) => [column.name, column.declared[row]]);
  return { ...model.study.defaults, ...Object.fromEntries(swept) };
}

/** The reason why no motion is drawn; empty if one is. */
function missingMotionReason(model, row, motion) {
  if (motion) return "";
  if (!hasMotion(model.study.motion))
    return `This page has no drawing of the mechanism “${model.study.mechanism}”; its designs are shown in numbers.`;
  const { motion: declared, sentences } = model.study;
  const status = model.byName.get("status");
  const code = status?.values[row];
  const lacks = `No ${declared.limits ? "motion over its range" : "full turn"} to draw`;
  const broken = brokenParameter(declared, parametersOf(model, row));
  if (broken && (!status || declared.moving.includes(code)))
    return `${lacks}: the value of ${words(broken)} is none that it can take.`;
  const label = status?.labels?.[code];
  const sentence = Object.hasOwn(sentences, label) ? sentences[label] : "this design does not turn";
  return `${lacks}: ${sentence}.`;
}

/** Name what is drawn. */
function legendOf(legend, drawn) {
  if (!drawn) return legend.replaceChildren();
  const { drawing, motion } = drawn;
  const entry = (sample, text) => el("span", { class: "item" }, sample, text);
  const item = (look, text) => entry(el("i", { class: `swatch ${look}` }), text);
  const items = [...drawing.links, ...drawing.profiles].map(({ name }, k) => item(`hue-${HUES[k % HUES.length]}`, name));
  for (const path of pointPaths(drawing)) items.push(entry(dashedLine(path.dashes), path.long_name));
  if (drawn.target) items.push(item("target", "target"));
  if (motion.stroke) items.push(item("drive", "drive stroke"));
  if (motion.dwell) items.push(item("drive", `dwell ${number(motion.dwell[1] - motion.dwell[0], 4)}°`));
  limitsOf(motion).forEach(([name, angle], k) => {
    items.push(item(`limit-${k % DASHES.length}`, `${name} ${angleText(shownAngle(motion.span, angle), 1)}`));
  });
  legend.replaceChildren(...items);
}
