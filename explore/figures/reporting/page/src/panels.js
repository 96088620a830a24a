/** The charts of a motion: title, unit and lines of each panel that the mechanism declares. */

import { targetPanel } from "./distance.js";
import { countOf } from "./format.js";
import { output } from "./mechanism.js";

const SINGLE = ["green", "purple", "blue", "orange", "ink"];
const PAIR = ["orange", "blue"],
  SEVERAL = ["orange", "sky", "green", "ink", "purple", "blue"];

/**
 * The panels of a design: the distance from the target where there is one, then those that the mechanism declares.
 * @param {{motion: Object, turn: Object, drawing: ?Object}} one its `turn` is from `overTheTurn`
 * @returns {Array<{title: string, unit: string, factor: number, fullTurn: number, fromZero: boolean, motion: Object, traces: Array, empty: string}>}
 *   each trace with the signal, its colour, dash, marker and label, its values over the turn and those at an input angle;
 *   `empty` says why there is none
 */
export function panelsOf(one) {
  const { motion, turn } = one;
  const { declared, values, stroke, drive } = motion;
  const shown = declared.panels.filter(
    (panel) => (!panel.loads.length || panel.loads.some((load) => values[load])) && (!panel.clutch || drive !== "none"),
  );
  const panels = shown.map((panel, place) => {
    const rectified = declared.signals.find(({ name, rectified }) => rectified && name === panel.signals[0]);
    const { label: title, unit, factor, turn: fullTurn } = panel;
    const lines = rectified ? clutchLines(motion, rectified) : linesOf(panel.signals, place);
    const traces = lines.map((line) => traceOf(line, factor, motion, turn));
    const fromZero = panel.magnitude || Boolean(rectified && stroke);
    const empty = rectified ? "the output turns fully: no stroke" : "no value at any input angle";
    return { title, unit, factor, fullTurn, fromZero, motion, traces, empty };
  });
  const ofTarget = targetPanel(one);
  return ofTarget ? [ofTarget, ...panels] : panels;
}

/**
 * The panels of several designs: one for each signal, with a line of each design in its look.
 * @param {Array<{motion: Object, turn: Object, look: Object}>} shown
 */
export function comparedPanels(shown) {
  const panels = new Map();
  for (const one of shown) {
    for (const panel of panelsOf(one)) {
      // Of an output through clutches that of all mechanisms.
      const signals = panel.traces.filter(({ isPart }) => !isPart);
      for (const trace of signals) {
        const title = signals.length > 1 ? `${panel.title}: ${trace.label}` : panel.title;
        if (!panels.has(title)) panels.set(title, { ...panel, title, motion: null, marks: [], traces: [] });
        panels.get(title).traces.push({ ...trace, ...one.look, label: "" });
      }
    }
  }
  return [...panels.values()];
}

/** A line over the turn with its values in the unit of the panel. */
function traceOf({ name, hue, dash = [], label, at }, factor, motion, turn) {
  const signal = at ?? ((degrees) => motion.at(degrees)[name]);
  const values = at ? Float64Array.from(turn.angles, at) : turn.series[name];
  return {
    name,
    hue,
    label,
    dash,
    marker: "",
    isPart: Boolean(at),
    motion,
    angles: turn.angles,
    values: values.map((one) => factor * one),
    at: (degrees) => factor * signal(degrees),
  };
}

function linesOf(names, place) {
  if (names.length === 1) return [{ name: names[0], hue: SINGLE[place % SINGLE.length], label: "" }];
  const hues = names.length === 2 ? PAIR : SEVERAL;
  const words = names.map((name) => name.split("_"));
  const distinct = (each) => each.filter((word) => !words.every((others) => others.includes(word))).join(" ");
  // Beyond the hues lines are dashed, the more the farther.
  const dashOf = (k) => (k < hues.length ? [] : [8 / Math.floor(k / hues.length), 3]);
  return names.map((name, k) => ({ name, hue: hues[k % hues.length], dash: dashOf(k), label: distinct(words[k]) }));
}

function clutchLines(motion, signal) {
  const all = { name: signal.name, hue: "ink", label: countOf(motion.phases, "mechanism") };
  if (motion.phases === 1) return [all];
  return [{ name: signal.name, hue: "sky", label: "1 mechanism", at: (angle) => output(motion, signal, angle, 1) }, all];
}
