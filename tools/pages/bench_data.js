// SPDX-License-Identifier: BSD-3-Clause
// The results, the switches of solvers and timesteppers, and charts that follow them.
"use strict";
const results = JSON.parse(document.getElementById("results").textContent);
const solverLabels = [...new Set(results.solves.map((row) => row.label))];
const steppers = [...new Set(results.simulations.map((row) => row.timestepper))];
const seriesNames = [...solverLabels, ...steppers];
// Solvers and timesteppers never share a chart, so that each kind has all colours for itself.
const styles = new Map([...lineStyles(steppers), ...lineStyles(solverLabels)]);
const colourOf = (name) => styles.get(name)?.colour;
const problemOf = Object.fromEntries(results.problems.map((problem) => [problem.problem, problem]));
const sceneOf = Object.fromEntries(results.scenes.map((scene) => [scene.scene, scene]));
const solvedRow = (row) => row.cause === "";
const totalSeconds = (row) => (row.seconds.setup === null ? null : row.seconds.setup + row.seconds.solve);
// Left out, as it failed at a looser tolerance.
const skippedRow = (row) => row.skipped_after !== undefined;
const statusMark = (row) => element("span", { className: `status ${row.cause || row.status}`,
  textContent: spoken(row.cause || row.status) + (skippedRow(row) ? " (not run)" : "") });
const swatch = (name) => swatchOf(styles.get(name));

const hidden = new Set();
const charts = [];

// A chart whose option is made anew when a switch is turned. It is drawn when it comes near the window, or is printed.
function addChart(place, option) {
  const entry = { place, option, chart: null };
  entry.draw = () => {
    if (!entry.chart) {
      entry.chart = echarts.init(place, null, { renderer: "svg" });
      document.documentElement.dataset.chartsDrawn = Number(document.documentElement.dataset.chartsDrawn || 0) + 1;
    }
    entry.chart.setOption(entry.option(), { notMerge: true });
  };
  place.chart = entry;
  charts.push(entry);
  watch.observe(place);
  return entry;
}

const watch = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) if (isIntersecting && !target.chart.chart) target.chart.draw();
}, { rootMargin: "800px" });

function toggle(name) {
  if (!hidden.delete(name)) hidden.add(name);
  for (const button of document.querySelectorAll("#legend button"))
    if (button.dataset.name === name) button.setAttribute("aria-pressed", String(!hidden.has(name)));
  for (const entry of charts) if (entry.chart) entry.draw();
  document.documentElement.dataset.hidden = [...hidden].join(";");
}

const table = (head, rows, textColumns = 1) =>
  element("div", { className: "scroll" }, element("table", {},
    element("thead", {}, element("tr", {}, ...head.map((textContent, k) => element("th", { textContent, className: k < textColumns ? "text" : "" })))),
    element("tbody", {}, ...rows.map(({ cells, className = "" }) => element("tr", { className }, ...cells.map((cell, k) =>
      element("td", { className: k < textColumns ? "text" : "" }, ...(Array.isArray(cell) ? cell : [cell]))))))));

const logAxis = (name, nameGap = 32) => ({ ...axisStyle, type: "log", name, nameGap, axisLabel: { formatter: power } });
const linearAxis = (name, nameGap = 32) =>
  ({ ...axisStyle, type: "value", name, nameGap, axisLabel: { showMaxLabel: false, formatter: (value) => String(+value.toPrecision(6)) } });

// Limits at whole decades around positive values.
function decades(values) {
  const positive = values.filter((value) => value > 0);
  if (positive.length === 0) return { min: 0.1, max: 10 };
  const min = decade(Math.min(...positive), Math.floor), max = decade(Math.max(...positive) * 1.0001, Math.ceil);
  return { min, max: max > min ? max : 10 * min };
}

// What every chart has; tooltip texts are made of elements, since names are text and never markup.
const baseOption = (description) => ({
  animation: false, textStyle: { fontFamily: getComputedStyle(document.body).fontFamily, color: "#1d2329" },
  aria: { enabled: true, label: { description } },
  grid: { left: 62, right: 18, top: 14, bottom: 48 },
  tooltip: { trigger: "item", confine: true, formatter: ({ seriesName, data }) =>
    element("div", {}, element("b", { textContent: seriesName, style: `color:${colourOf(seriesName)}` }), ...(data.lines || data[2] || []).flatMap((line) => [element("br"), line])) },
});

const lineSeries = (name, data, more = {}) => ({
  name, type: "line", data, color: colourOf(name), animation: false, symbol: "circle", symbolSize: 6,
  lineStyle: { width: 1.8, type: dashType(styles.get(name).dash) }, emphasis: { disabled: true }, ...more,
});

function section(id, title, ...children) {
  const made = element("section", { id }, element("h2", { textContent: title }), ...children);
  document.getElementById("sections").append(made);
  document.getElementById("contents").querySelector("ul").append(element("li", {}, element("a", { href: "#" + id, textContent: title })));
  return made;
}

// A box to choose one of the texts in; choose is called with its index.
function selectBox(label, texts, chosen, choose) {
  const box = element("select", { ariaLabel: label, onchange: () => choose(box.selectedIndex) }, ...texts.map((textContent) => element("option", { textContent })));
  box.selectedIndex = chosen;
  return box;
}
