/** The results files of a page of several: which one a design is from, and how it is told apart. */

import { SHAPES } from "./marks.js";
import { colours } from "./theme.js";

/** The column that says which file a design is from; only pages of several files have it. */
export const RESULTS = "results";

/** Colours and marks of the files, in their order; the marks are none of pinned designs. */
export const FILE_LOOKS = [
  { hue: "blue", marker: "disc" },
  { hue: "orange", marker: "plus" },
  { hue: "purple", marker: "pentagon" },
  { hue: "green", marker: "hourglass" },
  { hue: "sky", marker: "bow" },
  { hue: "red", marker: "bar" },
];

/** Facts of the file that a design is from; the study where the page has one file. */
export const fileOf = ({ study, byName }, row) => (study.files ? study.files[byName.get(RESULTS).values[row]] : study);

/** Whether a view colours designs by their files. */
export const isByFile = (model, colour) => Boolean(model.study.files) && colour === RESULTS;

/** Colour of each row by its file. */
export function fileColours(model) {
  const { values } = model.byName.get(RESULTS);
  const known = FILE_LOOKS.map(({ hue }) => colours()[hue]);
  return (row) => known[values[row]];
}

/** A function that draws the mark of a row's file at a point, with the context's own colours. */
export function fileMarks(context, model) {
  const { values } = model.byName.get(RESULTS);
  const outlines = FILE_LOOKS.map(({ marker }) => new Path2D(SHAPES[marker]));
  return (row, x, y, size, isOutlined) => {
    context.save();
    context.translate(x, y);
    context.scale(size / 5, size / 5);
    context.lineWidth *= 5 / size;
    context.fill(outlines[values[row]]);
    if (isOutlined) context.stroke(outlines[values[row]]);
    context.restore();
  };
}
