// SPDX-License-Identifier: BSD-3-Clause
// A heat map for each axis: methods by values, each cell its outcome and the figure behind it. A table, so that it prints, can be
// read aloud and copied; a sign stands beside the colour.
"use strict";
const outcomes = {
  correct: ["✓", "within all bounds"],
  inaccurate: ["≈", "claimed as solved, beyond a bound"],
  refused: ["–", "not taken, with a sentence that says why"],
  failed: ["✗", "the library itself says that it came to no end, and why"],
  wrong: ["‼", "claimed as solved, but above the tolerance or not finite"],
  crashed: ["†", "its process crashed"],
  hung: ["∞", "did not end at its time limit and was killed"],
};
const outcomeMark = (outcome) => element("span", { className: `outcome ${outcome}`, textContent: `${outcomes[outcome][0]} ${outcome}` });
const figureText = (value) => (value === null ? "" : value === 0 ? "0" : value.toExponential(0).replace("e+", "e"));

// What hovering over a cell says, and what is read aloud.
function cellSentence(cell) {
  const within = cell.limit === null ? "" : `, bound ${short(cell.limit)}`;
  const figure = cell.measure && cell.figure !== null ? `${spoken(cell.measure)} ${error(cell.figure)}${within}` : "";
  return [`${cell.method} at ${short(cell.value)}: ${cell.outcome}`, figure, cell.sentence, cell.from].filter(Boolean).join("\n");
}

function heatMap(axis, cells) {
  const methods = [...new Set(cells.map((cell) => cell.method))];
  const cellOf = (method, value) => cells.find((cell) => cell.method === method && cell.value === value);
  const draw = (cell) => (cell === undefined ? element("td", { textContent: missing }) : Object.assign(
    element("td", { className: `outcome ${cell.outcome}`, title: cellSentence(cell), tabIndex: 0 },
      element("b", { textContent: outcomes[cell.outcome][0] }), element("span", { textContent: figureText(cell.figure) })), { ariaLabel: cellSentence(cell) }));
  return element("div", { className: "scroll" }, element("table", { className: "heat" },
    element("thead", {}, element("tr", {}, element("th", { className: "text", textContent: axis.unit ? `${axis.title} [${axis.unit}]` : axis.title }),
      ...axis.values.map((value) => element("th", { scope: "col", textContent: short(value) })))),
    element("tbody", {}, ...methods.map((method) => element("tr", {}, element("th", { scope: "row", className: "text", textContent: method }),
      ...axis.values.map((value) => draw(cellOf(method, value))))))));
}

function boundsText(axis) {
  const names = [...new Set(axis.bounds.flatMap((bounds) => Object.keys(bounds)))];
  return names.map((name) => {
    const limits = [...new Set(axis.bounds.map((bounds) => +bounds[name].toPrecision(3)))];
    return `${spoken(name)} ≤ ${limits.length === 1 ? short(limits[0]) : `${short(limits[0])} … ${short(limits.at(-1))} by value`}`;
  }).join("; ");
}

function writeAxes() {
  if (results.axes.length === 0) return;
  section("axes", "Where methods break", element("p", { className: "facts" }, ...Object.keys(outcomes).flatMap((outcome) =>
    [outcomeMark(outcome), ` ${results.cells.filter((cell) => cell.outcome === outcome).length}: ${outcomes[outcome][1]}. `]),
  "The number is the figure nearest to its bound, or farthest beyond it; where a run failed, the natural error that it had reached."));
  results.axes.forEach((axis, k) => {
    const cells = results.cells.filter((cell) => cell.axis === axis.axis);
    const told = cells.filter((cell) => cell.outcome !== "correct" && cell.sentence);
    section(`axis-${k + 1}`, axis.title, element("p", { className: "facts", textContent: `Bounds: ${boundsText(axis)}. ${axis.reason}` }), heatMap(axis, cells),
      ...(told.length === 0 ? [] : [element("details", {}, element("summary", { textContent: `What ${plural(told.length, "cell")} said` }),
        element("ul", { className: "notes" }, ...told.map((cell) => element("li", {}, element("b", { textContent: `${cell.method} at ${short(cell.value)}: ` }), outcomeMark(cell.outcome), ` ${cell.sentence}`))))]));
  });
}
