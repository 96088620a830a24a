/** The mechanisms that a page can draw; designs of others are shown in numbers. */

import { drawLinkage, heightOf } from "./linkage.js";
import { fourBarMotion, overTheTurn } from "./motion.js";

const FOUR_BAR = ["crank", "coupler", "rocker", "ground"];

/** Curves of a four-bar: title, unit, and the signals in one chart with their colours. */
const FOUR_BAR_CURVES = [
  { title: "rocker angle", unit: "deg", lines: [["rocker_angle", "blue"]] },
  { title: "transmission angle", unit: "deg", lines: [["transmission_angle", "green"]] },
  {
    title: "angular velocity",
    unit: "rad/s",
    lines: [
      ["coupler_velocity", "orange", "coupler"],
      ["rocker_velocity", "blue", "rocker"],
    ],
  },
  {
    title: "angular acceleration",
    unit: "rad/s²",
    lines: [
      ["coupler_acceleration", "orange", "coupler"],
      ["rocker_acceleration", "blue", "rocker"],
    ],
  },
];

/** Further curves of a mechanism with clutches. */
const CLUTCH_CURVES = [
  { title: "velocity ratio", unit: "", lines: [["velocity_ratio", "purple"]] },
  {
    title: "clutch output",
    unit: "rad/s",
    lines: [
      ["one_clutch", "sky", "1 linkage"],
      ["output_velocity", "ink", "all"],
    ],
  },
];

/** @type {Array<{suits: Function, motion: Function, over: Function, draw: Function, height: Function, curves: Function}>} */
const REGISTRY = [
  {
    suits: (name, values) => name === "crank-rocker" || FOUR_BAR.every((parameter) => parameter in values),
    motion: fourBarMotion,
    over: overTheTurn,
    draw: drawLinkage,
    height: heightOf,
    curves: (drive) => (drive === "none" ? FOUR_BAR_CURVES : [...FOUR_BAR_CURVES, ...CLUTCH_CURVES]),
  },
];

/** The drawing of a mechanism; undefined for a mechanism without one. */
export const drawingOf = (name, values) => REGISTRY.find((entry) => entry.suits(name, values));
