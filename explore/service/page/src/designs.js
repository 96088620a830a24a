/** The chosen design, drawn as in a report: its data are asked for when it is chosen. */

import { el } from "../../../figures/reporting/page/src/dom.js";
import { designPanel } from "../../../figures/reporting/page/src/design.js";
import { FRONT, shown } from "../../../figures/reporting/page/src/payload.js";
import { Pins } from "../../../figures/reporting/page/src/pins.js";
import { Focus } from "../../../figures/reporting/page/src/selection.js";
import { RESULTS } from "../../../figures/reporting/page/src/files.js";
import { query } from "./sources.js";

/** Files that a design is exported to, by their endings. */
const FILES = [["toml", "study (TOML)"], ["csv", "motion (CSV)"], ["dxf", "drawing (DXF)"], ["svg", "drawing (SVG)"], ["gif", "animation (GIF)"]];

/**
 * @param {HTMLElement} root
 * @param {Array<Object>} sources
 * @param {(error: Error) => void} fail
 */
export function designs(root, sources, fail) {
  const chosen = new Focus(),
    pins = new Pins();
  let model = null,
    wanted = null,
    optimal = new Set();
  const files = el("p", { class: "files small" });
  chosen.listen(showFiles);

  /** Links to the files of the chosen design, and the address that opens this page with it. */
  function showFiles(row) {
    const design = model.designs[row],
      source = sources[model.byName.get(RESULTS)?.values[row] ?? 0].name,
      address = new URL(location);
    address.searchParams.set("design", design);
    address.searchParams.set("of", source);
    history.replaceState(null, "", address);
    const file = ([kind, text]) =>
      el("a", { href: `/api/results/${encodeURIComponent(source)}/design/${design}/export/${kind}`, download: `${source}-${design}.${kind}`, "aria-label": `${text} of design ${design}` }, text);
    files.replaceChildren("Save: ", ...FILES.flatMap((one, k) => [k ? " · " : "", file(one)]), " — ", el("a", { href: address.href }, "link to this design"));
  }

  async function choose(source, design, kind) {
    wanted = `${source} ${design}`;
    const mine = wanted;
    try {
      const told = await query(sources[source], `design/${design}/motion`, {});
      if (!model) await loadFunctions(sources[source]);
      if (mine !== wanted) return;
      if (!model) model = emptyModel(told, sources);
      if (told.mechanism !== model.study.mechanism)
        throw new Error(`${sources[source].name} is of a ${told.mechanism}; only designs of a ${model.study.mechanism} are drawn beside each other`);
      const row = rowOf(model, told, source, kind === FRONT || optimal.has(wanted));
      if (model.panel) return chosen.set(row);
      model.panel = true;
      chosen.row = row;
      designPanel(root, model, { chosen, pins });
      root.querySelector(".panel-head").after(files);
      showFiles(row);
    } catch (error) {
      fail(error);
    }
  }

  /** Mark the designs that a ranking found Pareto-optimal, also those that were chosen before, as by a link. */
  function takeFronts(fronts) {
    optimal = new Set(fronts.flatMap((front, source) => front.designs.map(({ design }) => `${source} ${design}`)));
    const files = model?.byName.get(RESULTS);
    model?.designs.forEach((design, row) => {
      if (model.kinds[row] === FRONT || !optimal.has(`${files?.values[row] ?? 0} ${design}`)) return;
      model.kinds[row] = FRONT;
      if (row !== chosen.row) return;
      chosen.row = -1;
      chosen.set(row);
    });
  }

  return { choose, takeFronts, has: () => wanted !== null };
}

/** Load the mechanism's own functions; without a translation designs are shown in numbers. */
function loadFunctions({ name }) {
  return new Promise((done) => {
    const script = document.createElement("script");
    script.src = `/api/results/${encodeURIComponent(name)}/motion.js`;
    script.onload = script.onerror = () => done();
    document.head.append(script);
  });
}

/** A model without designs, of the columns that the first design has. */
function emptyModel(told, sources) {
  const study = { ...told, missed: told.missed ?? [], objectives: sources[0].objectives.map((text) => text.split(":")) };
  const columns = told.columns.map((column) => ({ ...column, declared: [], values: [] }));
  if (sources.length > 1) {
    study.files = sources.map(({ name }) => ({ name, drive: told.drive, target: null, lacks: [] }));
    const labels = Object.fromEntries(sources.map(({ name }, k) => [k, name]));
    columns.push({ name: RESULTS, unit: "", meaning: "results that the design is of", role: "bookkeeping", labels, verbatim: true, whole: true, declared: [], values: [] });
  }
  return { study, columns, byName: new Map(columns.map((column) => [column.name, column])), designs: [], kinds: [], size: 0 };
}

/** The row of a design, which is added if it is new; only a ranking knows that it is Pareto-optimal. */
function rowOf(model, told, source, isOptimal) {
  const [design] = told.designs;
  const files = model.byName.get(RESULTS);
  const known = model.designs.findIndex((one, row) => one === design && (!files || files.values[row] === source));
  if (known >= 0) return known;
  const given = new Map(told.columns.map((column) => [column.name, column]));
  for (const column of model.columns) {
    const declared = column === files ? source : (given.get(column.name)?.declared[0] ?? NaN);
    const ratio = given.get(column.name)?.ratio;
    column.declared.push(declared);
    column.values.push(ratio ? shown(declared, ratio) : declared);
  }
  if (files) {
    const lacks = model.columns.filter((column) => column !== files && !given.has(column.name)).map(({ name }) => name);
    Object.assign(model.study.files[source], { drive: told.drive, target: told.target, lacks });
  }
  model.designs.push(design);
  model.kinds.push(isOptimal ? FRONT : told.kinds[0]);
  return model.size++;
}
