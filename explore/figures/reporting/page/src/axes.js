/** The two axes of the scatter. */

import { axisBottom, axisLeft } from "d3-axis";
import { titled } from "./format.js";
import { tickMarks } from "./scales.js";

/**
 * Draw the axes with ticks and titles.
 * @param {{x: Object, y: Object}} layers groups of SVG
 * @param {{scaleX: Function, scaleY: Function, left: number, width: number, height: number}} view
 * @param {{left: number, right: number, top: number, bottom: number}} margin of the plot, pixels
 * @param {Array<import("./payload.js").Column>} columns of x and y
 * @param {Array<?[number, number]>} spans null where an axis is empty
 */
export function drawAxes(layers, view, margin, [x, y], spans) {
  const [bottom, left] = [view.height - margin.bottom, margin.left];
  const ticksX = tickMarks(view.scaleX, x, Math.max(2, view.width / 90), spans[0]),
    ticksY = tickMarks(view.scaleY, y, 7, spans[1]);
  layers.x
    .attr("transform", `translate(0,${bottom})`)
    .call(axisBottom(view.scaleX).tickValues(ticksX.values).tickFormat(ticksX.text).tickSize(4));
  layers.y
    .attr("transform", `translate(${left},0)`)
    .call(axisLeft(view.scaleY).tickValues(ticksY.values).tickFormat(ticksY.text).tickSize(4));
  title(layers.x, titled(x), (view.left + view.width - margin.right) / 2, 38, 0);
  // Beside the widest tick, and never outside of the plot.
  const widest = Math.max(0, ...layers.y.selectAll(".tick text").nodes().map((node) => node.getBBox().width));
  title(layers.y, titled(y), -(margin.top + bottom) / 2, -Math.min(left - 12, Math.max(48, widest + 16)), -90);
}

function title(layer, text, x, y, turn) {
  layer
    .selectAll(".title")
    .data([text])
    .join("text")
    .attr("class", "title")
    .attr("transform", turn ? `rotate(${turn})` : null)
    .attr("x", x)
    .attr("y", y)
    .attr("fill", "currentColor")
    .attr("text-anchor", "middle")
    .text(text);
}
