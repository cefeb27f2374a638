// SPDX-License-Identifier: BSD-3-Clause
// Scenes as they are and with nothing left out: what leaving out saves.
"use strict";
const savings = [
  { title: "time of stepping", head: "time s", unit: "s", of: (run) => run.seconds.stepping, text: seconds },
  { title: "most rows of a problem", head: "rows", unit: "", of: (run) => run.totals.most_rows ?? null, text: whole },
  { title: "peak memory", head: "MiB", unit: "MiB", of: (run) => run.peak_memory / 1048576, text: (value) => (value === null ? missing : value.toFixed(1)) },
  { title: "libraries in the process", head: "libraries", unit: "", of: (run) => run.libraries.length, text: whole },
];
const sides = [{ key: "as_is", label: "as it is", color: "#0072b2" }, { key: "forced", label: "nothing left out", color: "#e69f00" }];

// Relative to the scene as it is, so that scenes of any size stand beside one another.
function savingOption(rows, one) {
  const share = (row, side) => {
    const own = one.of(row.as_is), value = one.of(row[side.key]);
    return own > 0 && value !== null ? { value: value / own, lines: [`${row.name}: ${one.text(value)} ${one.unit}`] } : null;
  };
  return {
    ...baseOption(`${one.title}, as it is and with nothing left out`),
    tooltip: { trigger: "item", confine: true, formatter: ({ seriesName, data }) => element("div", {}, element("b", { textContent: seriesName }), ...data.lines.flatMap((line) => [element("br"), line])) },
    grid: { left: 150, right: 40, top: 28, bottom: 44 },
    legend: { top: 0, itemHeight: 8, data: sides.map(({ label }) => label) },
    xAxis: { ...linearAxis("times the scene as it is", 28), min: 0 },
    yAxis: { type: "category", inverse: true, data: rows.map((row) => row.name), axisTick: { show: false } },
    series: sides.map((side) => ({ name: side.label, type: "bar", color: side.color, animation: false, barMaxWidth: 14, data: rows.map((row) => share(row, side)) })),
  };
}

function writeLeavingOut() {
  const rows = results.leaving_out;
  if (rows.length === 0) return;
  const grid = element("div", { className: "grid wide" });
  const pairs = (one, row) => sides.map((side) => (row[side.key].cause ? spoken(row[side.key].cause) : one.text(one.of(row[side.key]))));
  section("leaving-out", "What leaving out saves", element("p", { className: "facts", textContent:
    "Each scene as it is, and with nothing left out (leave_out: false): one problem with all of its parts, H factorised as a sparse matrix, three rows for " +
    "contacts without friction, a solver for every kind of cone and the collision library loaded. The physics is the same: the last column says how far apart the two ends are, relative to the way that the scene goes (nothing of a scene that stands still)." }),
    grid,
    table(["scene", ...savings.flatMap(({ head }) => [head, "all kept"]), "ends differ by"],
      rows.map((row) => ({ cells: [row.name, ...savings.flatMap((one) => pairs(one, row)), error(row.forced.error.position)] }))),
    element("details", {}, element("summary", { textContent: "what is left out, and the libraries that come with it" }),
      ...rows.map((row) => element("div", { className: "two" }, planList(`${row.name}: left out`, row.left_out),
        element("div", {}, element("b", { textContent: "libraries only where nothing is left out" }),
          element("p", { textContent: row.forced.libraries.filter((file) => !row.as_is.libraries.includes(file)).join(", ") || "none" }))))),
    ...(rows.some((row) => row.as_is.message || row.forced.message) ? [element("ul", { className: "notes" }, ...rows.flatMap((row) =>
      sides.filter(({ key }) => row[key].message).map(({ key, label }) => element("li", {}, element("b", { textContent: `${row.name}, ${label}: ` }), row[key].message))))] : []));
  for (const one of savings) {
    const place = element("div", { className: "chart", style: `height:${70 + 34 * rows.length}px` });
    grid.append(element("div", {}, element("h4", { textContent: one.title }), place));
    addChart(place, () => savingOption(rows, one));
  }
}
