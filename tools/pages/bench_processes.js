// SPDX-License-Identifier: BSD-3-Clause
// Solvers that share a problem among processes: strong and weak scaling, what they send, what their time goes to.
"use strict";
const phaseColours = [["setup", "#202020"], ["products", "#0072b2"], ["projections", "#009e73"], ["linear_systems", "#6a3d9a"],
  ["exchange", "#56b4e9"], ["reductions", "#e69f00"], ["waiting", "#d55e00"], ["other", "#b5bcc3"]];

// Groups of runs have names of their own, and so colours of their own.
const groupName = (one, subject) => `${one.solver}, ${one[subject]}${one.load ? `, ${whole(Math.round(one.load))} a process` : ""}, ${short(one.tolerance)}`;

function groupsOption(description, groups, subject, { x, y, value, logarithmic, ideal, lines }) {
  const names = groups.map((one) => groupName(one, subject));
  const look = lineStyles(names);
  const counts = [...new Set(groups.flatMap((one) => one.points.map((point) => point.processes)))].sort((a, b) => a - b);
  const series = groups.map((one, k) => ({
    name: names[k], type: "line", animation: false, symbol: "circle", symbolSize: 7, color: look.get(names[k]).colour, emphasis: { disabled: true },
    lineStyle: { width: 1.8, type: dashType(look.get(names[k]).dash) },
    data: one.points.filter((point) => value(point) !== null).map((point) => ({ value: [String(point.processes), value(point)], lines: lines(point) })),
  }));
  return {
    ...baseOption(description),
    tooltip: { trigger: "item", confine: true, formatter: ({ seriesName, data }) =>
      element("div", {}, element("b", { textContent: seriesName, style: `color:${look.get(seriesName)?.colour}` }), ...(data.lines || []).flatMap((line) => [element("br"), line])) },
    legend: { type: "scroll", top: 0, itemHeight: 8, data: names },
    grid: { left: 62, right: 18, top: 34, bottom: 48 },
    xAxis: { ...axisStyle, type: "category", name: x, nameGap: 28, data: counts.map(String) },
    yAxis: logarithmic ? { ...logAxis(y, 46), ...decades(series.flatMap((one) => one.data.map((point) => point.value[1]))) } : { ...linearAxis(y, 44), min: 0 },
    series: ideal === undefined ? series : [...series, { name: "ideal", type: "line", silent: true, showSymbol: false, color: "#5c6670",
      lineStyle: { type: "dashed", width: 1 }, data: counts.map((count) => [String(count), ideal]) }],
  };
}

const pointLines = (point) => [`${point.problem}: ${point.processes === 1 ? "1 process" : `${point.processes} processes`}`, `${seconds(point.seconds)} s, efficiency ${point.efficiency === null ? missing : point.efficiency.toFixed(2)}`,
  `${whole(point.iterations)} iterations, efficiency of one ${point.efficiency_of_an_iteration === null ? missing : point.efficiency_of_an_iteration.toFixed(2)}`, `${mebibytes(point.peak_memory)} MiB`];

// Bytes against contacts at fixed numbers of processes.
function trafficOption(list) {
  const name = (one) => `${one.solver}, ${one.processes} processes, ${short(one.tolerance)}`;
  const look = lineStyles(list.map(name));
  const values = list.flatMap((one) => one.points);
  return {
    ...baseOption("bytes sent an iteration against contacts"),
    tooltip: { trigger: "item", confine: true, formatter: ({ seriesName, data }) =>
      element("div", {}, element("b", { textContent: seriesName, style: `color:${look.get(seriesName)?.colour}` }), element("br"), `${whole(data[0])} contacts: ${data[1].toPrecision(4)} bytes`) },
    legend: { type: "scroll", top: 0, itemHeight: 8, data: list.map(name) },
    grid: { left: 62, right: 18, top: 34, bottom: 48 },
    xAxis: { ...logAxis("contacts or rows"), ...decades(values.map(([size]) => size)) },
    yAxis: { ...logAxis("bytes an iteration, all processes", 46), ...decades(values.map(([, bytes]) => bytes)) },
    series: list.map((one) => ({ name: name(one), type: "line", animation: false, symbol: "circle", symbolSize: 7, color: look.get(name(one)).colour,
      lineStyle: { width: 1.8, type: dashType(look.get(name(one)).dash) }, emphasis: { disabled: true }, data: one.points })),
  };
}

// Shares of the time, a bar for each run.
function splitOption(bars) {
  return {
    ...baseOption("what the time goes to, mean of the processes"),
    tooltip: { trigger: "item", confine: true, formatter: ({ seriesName, data, name }) =>
      element("div", {}, element("b", { textContent: name }), element("br"), `${spoken(seriesName)}: ${(100 * data.value).toFixed(1)} %, ${seconds(data.seconds)} s`) },
    legend: { top: 0, itemHeight: 8, data: phaseColours.map(([phase]) => ({ name: phase })), formatter: spoken },
    grid: { left: 240, right: 24, top: 56, bottom: 44 },
    xAxis: { ...linearAxis("share of the time", 28), min: 0, max: 1 },
    yAxis: { type: "category", inverse: true, data: bars.map(({ name }) => name), axisTick: { show: false }, axisLabel: { width: 228, overflow: "truncate" } },
    series: phaseColours.map(([phase, color]) => ({ name: phase, type: "bar", stack: "time", color, animation: false, barMaxWidth: 16,
      data: bars.map(({ phases, all }) => ({ value: (phases[phase] || 0) / all, seconds: phases[phase] ?? 0 })) })),
  };
}

function writeProcesses() {
  const { strong, weak, traffic, beyond_cores: beyond } = results.analysis.processes;
  if (strong.length === 0 && weak.length === 0) return;
  const grid = element("div", { className: "grid wide" });
  const rows = (list, subject) => list.flatMap((one) => one.points.map((point) => ({ cells: [one.solver, one[subject], whole(Math.round(point.size)), short(one.tolerance),
    String(point.processes), seconds(point.seconds), point.efficiency === null ? missing : point.efficiency.toFixed(2), whole(point.iterations),
    point.efficiency_of_an_iteration === null ? missing : point.efficiency_of_an_iteration.toFixed(2),
    point.bytes_an_iteration === null ? missing : whole(Math.round(point.bytes_an_iteration)), mebibytes(point.peak_memory), whole(point.ghosts),
    point.imbalance === null ? missing : point.imbalance.toFixed(3)] })));
  const head = (subject) => ["solver", subject, "contacts or rows", "asked for", "processes", "time s", "efficiency", "iterations", "of an iteration",
    "bytes an iteration", "MiB", "ghosts", "imbalance"];
  const drawings = [];
  const chart = (title, height, option) => {
    const place = element("div", { className: "chart", style: height ? `height:${height}px` : "" });
    grid.append(element("div", {}, element("h4", { textContent: title }), place));
    drawings.push(() => addChart(place, option));
  };
  const efficiency = { x: "processes", y: "efficiency", value: (point) => point.efficiency, ideal: 1, lines: pointLines };
  if (strong.length > 0) {
    chart("strong scaling: efficiency on the same problem", 0, () => groupsOption("efficiency against processes", strong, "problem", efficiency));
    chart("strong scaling: time", 0, () => groupsOption("time against processes", strong, "problem",
      { x: "processes", y: "setup and solve [s]", value: (point) => point.seconds, logarithmic: true, lines: pointLines }));
    chart("memory of the largest process", 0, () => groupsOption("memory against processes", strong, "problem",
      { x: "processes", y: "MiB", value: (point) => point.peak_memory / 1048576, logarithmic: true, lines: pointLines }));
  }
  if (weak.length > 0)
    chart("weak scaling: efficiency with as many contacts on each process", 0, () => groupsOption("efficiency against processes", weak, "family", efficiency));
  if (traffic.length > 0) chart("what is sent", 0, () => trafficOption(traffic));
  const bars = strong.flatMap((one) => one.points.filter((point) => point.phases).map((point) => ({
    name: `${one.solver}, ${one.problem}, ${short(one.tolerance)}: ${point.processes}`, phases: point.phases,
    all: Object.values(point.phases).reduce((sum, value) => sum + value, 0) || 1 })));
  if (bars.length > 0) chart("what the time goes to, mean of the processes", 110 + 22 * bars.length, () => splitOption(bars));
  section("processes", "Processes",
    element("p", { className: "facts", textContent:
      "One problem in parts on several processes. Efficiency is T₁ / (P T) on the same problem, and T₁ / T with as many contacts on each process; T₁ is the run on the fewest processes, " +
      "P how many times as many there are. Bytes are those of all processes together, ghosts the columns of others that rows have to do with, imbalance the largest part over the mean." }),
    ...(beyond === null ? [] : [element("p", { className: "warning", textContent:
      `Up to ${beyond} processes shared the ${plural(results.session.machine.cores, "core")} of this machine: times beyond as many processes as cores say nothing about scaling.` })]),
    grid,
    ...(traffic.some((one) => one.fit) ? [table(["solver", "family", "asked for", "processes", "bytes an iteration ~ sizeᵖ, p"],
      traffic.filter((one) => one.fit).map((one) => ({ cells: [one.solver, one.family, short(one.tolerance), String(one.processes),
        `${one.fit.exponent.toFixed(2)} ± ${one.fit.standard_error.toFixed(2)}`] })), 2)] : []),
    ...(strong.length > 0 ? [element("h4", { textContent: "strong scaling" }), table(head("problem"), rows(strong, "problem"), 2)] : []),
    ...(weak.length > 0 ? [element("h4", { textContent: "weak scaling" }), table(head("family"), rows(weak, "family"), 2)] : []));
  for (const draw of drawings) draw();
}
