/** The page: reads its data and builds the views, which share one selection and one chosen design. */

import { readDensity } from "./density.js";
import { designPanel, parametersOf } from "./design.js";
import { poseAt, sum } from "./drawing.js";
import { opacity } from "./marks.js";
import { motionOf, strokeOf } from "./mechanism.js";
import { parallel } from "./parallel.js";
import { readModel } from "./payload.js";
import { Pins } from "./pins.js";
import { savedFiles } from "./saved.js";
import { scatter } from "./scatter.js";
import { Focus, Selection } from "./selection.js";
import { facts, header, notices } from "./summary.js";
import { table } from "./table.js";
import { tips } from "./tip.js";
import { toolbar } from "./toolbar.js";

const root = (id) => document.getElementById(id);

async function start() {
  const model = await readModel();
  await readDensity(model.study);
  const shared = {
    selection: new Selection(model),
    hover: new Focus(),
    chosen: new Focus(model.size ? model.study.chosen : -1),
    pins: new Pins(),
    tip: tips(root("tip"), model),
  };
  header(root("header"), model);
  notices(root("notices"), model);
  facts(root("study-facts"), model, (design) => {
    shared.chosen.set(model.designs.indexOf(design));
    // Where the selection sticks to the top of the window it covers what is there.
    const covered = getComputedStyle(root("selection")).position === "sticky" ? root("selection").offsetHeight + 8 : 0;
    root("design").style.setProperty("scroll-margin-top", `${covered}px`);
    root("design").scrollIntoView();
  });
  const rows = table(root("table"), model, shared);
  const axes = parallel(root("parallel"), model, shared);
  const cloud = scatter(root("scatter"), model, shared);
  designPanel(root("design"), model, shared);
  savedFiles(root("design"), model, shared.chosen);
  toolbar(root("selection"), model, shared, rows.rows, axes.refresh);
  Object.assign(page, { model, shared, rows: rows.rows, whereIs: cloud.whereIs });
  // Two frames on, everything was drawn.
  requestAnimationFrame(() =>
    requestAnimationFrame(() => {
      document.documentElement.dataset.ready = String(Math.round(performance.now()));
    }),
  );
}

/** The state of the page, for the browser's console and for tests. */
export const page = {};
export { motionOf, opacity, parametersOf, poseAt, strokeOf, sum };

start().catch((error) => {
  root("notices").textContent = `This page cannot be shown: ${error.message}. A browser of 2023 or later is needed.`;
  throw error;
});
