/** What stands below the scatter: what the marks mean, and what the picture does not show. */

import { el } from "./dom.js";
import { count, number, titled } from "./format.js";
import { KINDS, glyph } from "./marks.js";

/** Marks with the number of designs of each kind. */
export function legendOf(legend, model, view, density) {
  const many = ({ held, there }) => (held < there ? `${count(held)} of ${count(there)}` : count(there));
  const kinds = model.study.parts
    .filter(({ there }) => there)
    .map((part) => [glyph(part.kind), `${KINDS[part.kind].name}: ${many(part)}`]);
  const items = [
    ...kinds.map(([mark, text]) => el("span", { class: "item" }, mark, text)),
    el("span", { class: "item" }, glyph("chosen"), "chosen"),
  ];
  if (view.colour)
    items.push(
      el(
        "span",
        { class: "item" },
        number(view.least, 4),
        el("i", { class: "ramp" }),
        number(view.most, 4),
        ` ${titled(model.byName.get(view.colour))}`,
      ),
    );
  if (density)
    items.push(
      el(
        "span",
        { class: "item" },
        el("i", { class: "swatch density" }),
        "all feasible designs, stronger where there are more",
      ),
    );
  legend.replaceChildren(...items);
}

/** What the picture does not show, in words. */
export function told(points, view, density, model) {
  const parts = [];
  const undefinedWord = (log) => (log ? "undefined or not positive" : "undefined");
  if (points.missingX)
    parts.push(`${count(points.missingX)} designs in the left strip: ${view.x} is ${undefinedWord(view.logX)}`);
  if (points.missingY)
    parts.push(`${count(points.missingY)} in the lower strip: ${view.y} is ${undefinedWord(view.logY)}`);
  if (points.missingBoth) parts.push(`${count(points.missingBoth)} without either value`);
  if (points.outside) parts.push(`${count(points.outside)} outside of the axes (tick “outliers” to see them)`);
  if (points.missingColour) parts.push(`${count(points.missingColour)} without a value for the colour, drawn grey`);
  if (model.study.density && !density)
    parts.push("no density is known for these two columns: only the designs of this page are drawn");
  if (density) parts.push(`${count(density)} feasible designs counted in the cells`);
  return parts.length ? `${parts.join("; ")}.` : "";
}
