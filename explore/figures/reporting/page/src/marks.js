/** Marks of designs, which differ in shape and colour: × infeasible, dot feasible, ring Pareto-optimal, star chosen. */

import { svg } from "./dom.js";
import { colours } from "./theme.js";

/** Names and colours of the kinds, in the order of their codes. */
export const KINDS = [
  { name: "infeasible", colour: "red" },
  { name: "feasible", colour: "ink" },
  { name: "Pareto-optimal", colour: "blue" },
];

/**
 * Lines of each kind that together are as strong as one, and how strong one is at most and at least: fainter ones would
 * lose their hue to the rounding of the canvas.
 */
const OPAQUE_LINES = [12, 40, 55],
  STRONGEST = [0.25, 0.5, 0.8],
  FAINTEST = [0.03, 0.04, 0.04];

/** Opacity of each of a number of lines of a kind: it falls with the number, and is smaller for infeasible designs. */
export const opacity = (kind, lines) =>
  Math.min(STRONGEST[kind], Math.max(FAINTEST[kind], OPAQUE_LINES[kind] / (lines + 1)));

/** Draw a cross, dot or ring with the context's own colours. */
export function mark(context, kind, x, y, size) {
  context.beginPath();
  if (kind === 0) {
    const arm = size * 0.8;
    context.moveTo(x - arm, y - arm);
    context.lineTo(x + arm, y + arm);
    context.moveTo(x - arm, y + arm);
    context.lineTo(x + arm, y - arm);
    context.stroke();
  } else {
    context.arc(x, y, size, 0, 2 * Math.PI);
    if (kind === 1) context.fill();
    else {
      context.fill();
      context.stroke();
    }
  }
}

/** Outlines of the marks of kinds, of compared designs and of files, around the origin. */
export const SHAPES = {
  0: "M-3.5,-3.5L3.5,3.5M-3.5,3.5L3.5,-3.5",
  1: "M-3,0a3,3 0 1,0 6,0a3,3 0 1,0 -6,0",
  2: "M-4,0a4,4 0 1,0 8,0a4,4 0 1,0 -8,0",
  chosen: "M0,-6.5L1.6,-2.2L6.2,-2L2.6,0.8L3.8,5.3L0,2.7L-3.8,5.3L-2.6,0.8L-6.2,-2L-1.6,-2.2Z",
  square: "M-4.2,-4.2H4.2V4.2H-4.2Z",
  triangle: "M0,-5.6L5.2,3.8H-5.2Z",
  diamond: "M0,-6L4.6,0L0,6L-4.6,0Z",
  wedge: "M0,5.6L5.2,-3.8H-5.2Z",
  disc: "M-4.4,0a4.4,4.4 0 1,0 8.8,0a4.4,4.4 0 1,0 -8.8,0",
  plus: "M-1.8,-5H1.8V-1.8H5V1.8H1.8V5H-1.8V1.8H-5V-1.8H-1.8Z",
  pentagon: "M0,-5.4L5.1,-1.7L3.2,4.4H-3.2L-5.1,-1.7Z",
  hourglass: "M-4.4,-5H4.4L1,0L4.4,5H-4.4L-1,0Z",
  bow: "M-5,-4.4V4.4L0,1L5,4.4V-4.4L0,-1Z",
  bar: "M-5.4,-2.2H5.4V2.2H-5.4Z",
};

/** Draw one of the shapes at a point, filled and outlined. */
export function markAt(context, shape, x, y, scale) {
  context.save();
  context.translate(x, y);
  context.scale(scale, scale);
  context.lineWidth = 1;
  const outline = new Path2D(SHAPES[shape]);
  context.fill(outline);
  context.stroke(outline);
  context.restore();
}

/** A small picture of one of the shapes for legends and table cells. */
export function glyph(kind, label) {
  const named = label ? { role: "img", "aria-label": label } : { "aria-hidden": "true" };
  const node = svg("svg", { width: 14, height: 14, viewBox: "-7 -7 14 14", class: `glyph kind-${kind}`, ...named });
  node.append(svg("path", { d: SHAPES[kind] }));
  return node;
}

/** A piece of a dashed line for legends. */
export function dashedLine(dashes) {
  const node = svg("svg", { width: 34, height: 4, class: "dashed", "aria-hidden": "true" });
  node.append(svg("path", { d: "M1,2H33", "stroke-dasharray": dashes.join(" ") }));
  return node;
}

/** Colours of a scale from its low end to its high end, as text, between the anchors that the theme gives. */
export function ramp(anchors, steps) {
  return Array.from({ length: steps }, (_, k) => {
    const place = (k / (steps - 1)) * (anchors.length - 1),
      low = Math.min(Math.floor(place), anchors.length - 2);
    const parts = [1, 3, 5].map((at) => {
      const [a, b] = [anchors[low], anchors[low + 1]].map((colour) => parseInt(colour.slice(at, at + 2), 16));
      return Math.round(a + (b - a) * (place - low));
    });
    return `rgb(${parts.join(",")})`;
  });
}

/** Colour of a kind in the current theme. */
export const kindColour = (kind) => colours()[KINDS[kind].colour];
