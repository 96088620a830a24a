/** The charts of a motion: title, unit and lines of each panel that the mechanism declares. */

import { countOf } from "./format.js";
import { output } from "./mechanism.js";

const SINGLE = ["green", "purple", "blue", "orange", "ink"];
const PAIR = ["orange", "blue"],
  SEVERAL = ["orange", "sky", "green", "ink", "purple", "blue"];

/**
 * The panels of a motion.
 * @returns {Array<{title: string, unit: string, factor: number, fromZero: boolean, lines: Array}>} each line with the
 *   signal, its colour, its label, and a function of the input angle where it is not a signal of the motion
 */
export function panelsOf(motion) {
  const { declared, values, stroke, drive } = motion;
  const shown = declared.panels.filter(
    (panel) => (!panel.loads.length || panel.loads.some((load) => values[load])) && (!panel.clutch || drive !== "none"),
  );
  return shown.map((panel, place) => {
    const rectified = declared.signals.find(({ name, rectified }) => rectified && name === panel.signals[0]);
    const { label: title, unit, factor } = panel;
    const lines = rectified ? clutchLines(motion, rectified) : linesOf(panel.signals, place);
    return { title, unit, factor, fromZero: panel.magnitude || Boolean(rectified && stroke), lines };
  });
}

function linesOf(names, place) {
  if (names.length === 1) return [{ name: names[0], hue: SINGLE[place % SINGLE.length], label: "" }];
  const hues = names.length === 2 ? PAIR : SEVERAL;
  const words = names.map((name) => name.split("_"));
  const distinct = (each) => each.filter((word) => !words.every((others) => others.includes(word))).join(" ");
  return names.map((name, k) => ({ name, hue: hues[k], label: distinct(words[k]) }));
}

function clutchLines(motion, signal) {
  const all = { name: signal.name, hue: "ink", label: countOf(motion.phases, "mechanism") };
  if (motion.phases === 1) return [all];
  return [{ name: signal.name, hue: "sky", label: "1 mechanism", at: (angle) => output(motion, signal, angle, 1) }, all];
}
