/** The legend and the caption below the scatter. */

import { el } from "./dom.js";
import { FILE_LOOKS, isByFile } from "./files.js";
import { count, number, titled } from "./format.js";
import { KINDS, glyph } from "./marks.js";

/** Entry of a legend for a colour scale. */
export const rampItem = ({ least, most }, column) =>
  el("span", { class: "item" }, number(least, 4), el("i", { class: "ramp" }), number(most, 4), ` ${titled(column)}`);

/** Fill a legend with the marks and the number of designs of each kind. */
export function legendOf(legend, model, view, density) {
  const countText = ({ held, total }) => (held < total ? `${count(held)} of ${count(total)}` : count(total));
  const kinds = model.study.parts
    .filter(({ total }) => total)
    .map((part) => [glyph(part.kind), `${KINDS[part.kind].name}: ${countText(part)}`]);
  const items = [
    ...kinds.map(([mark, text]) => el("span", { class: "item" }, mark, text)),
    el("span", { class: "item" }, glyph("chosen"), "chosen"),
  ];
  if (isByFile(model, view.colour)) items.splice(0, items.length, ...fileItems(model));
  else if (view.colour) items.push(rampItem(view.shades, model.byName.get(view.colour)));
  if (density)
    items.push(
      el(
        "span",
        { class: "item" },
        el("i", { class: "swatch density" }),
        "density of all feasible designs",
      ),
    );
  legend.replaceChildren(...items);
}

/** The mark and the name of each file, with a text. */
export const fileNames = ({ study }, text = () => "") =>
  study.files.map((file, k) => {
    const look = glyph(FILE_LOOKS[k].marker);
    look.classList.add(`hue-${FILE_LOOKS[k].hue}`);
    return el("span", { class: "item long" }, look, `${file.name}${text(file)}`);
  });

/** Entries of the files, and the marks that all have. */
function fileItems(model) {
  const counts = ({ feasible, front: [own, joint] }) =>
    `: ${count(feasible)} feasible, ${count(own)} Pareto-optimal, ${count(joint)} of them jointly`;
  const [infeasible] = model.study.parts;
  return [
    ...fileNames(model, counts),
    ...(infeasible.total ? [el("span", { class: "item" }, glyph(0), `infeasible: ${count(infeasible.total)}`)] : []),
    el("span", { class: "item" }, "large and outlined: joint Pareto set"),
    el("span", { class: "item" }, glyph("chosen"), "chosen"),
  ];
}

/** Text about the designs that the scatter does not show in place. */
export function omissionText(points, view, density, model) {
  const parts = [];
  const undefinedWord = (log) => (log ? "undefined or not positive" : "undefined");
  if (points.missingX)
    parts.push(`${count(points.missingX)} designs in the left strip: ${view.x} is ${undefinedWord(view.logX)}`);
  if (points.missingY)
    parts.push(`${count(points.missingY)} in the lower strip: ${view.y} is ${undefinedWord(view.logY)}`);
  if (points.missingBoth) parts.push(`${count(points.missingBoth)} without either value`);
  if (points.outside) parts.push(`${count(points.outside)} outside the axes (${view.zoom ? "zoom out" : "tick “outliers”"} to see them)`);
  if (points.missingColour) parts.push(`${count(points.missingColour)} without a value for the colour, drawn grey`);
  if (model.study.density && !density)
    parts.push("the page has no density for these two columns: only its own designs are drawn");
  if (density) parts.push(`${count(density)} feasible designs counted in the cells`);
  return parts.length ? `${parts.join("; ")}.` : "";
}
