// SPDX-License-Identifier: BSD-3-Clause
// Two solvers against each other: profiles among many solvers change with who else is there, those of a pair do not.
"use strict";
const leastTime = 1e-5; // s; shorter times count as that, as in the profiles of all

// Of the problems of a class that one of the two solves at least: their times, null where one does not.
function pairTimes(rows, one, other) {
  const times = new Map();
  for (const row of rows) {
    if (row.label !== one && row.label !== other) continue;
    const key = row.problem + row.law;
    if (!times.has(key)) times.set(key, { [one]: null, [other]: null });
    if (solvedRow(row)) times.get(key)[row.label] = Math.max(totalSeconds(row), leastTime);
  }
  return [...times.values()].filter((pair) => pair[one] !== null || pair[other] !== null);
}

function ratiosOf(pairs, name, against) {
  return pairs.filter((pair) => pair[name] !== null)
    .map((pair) => (pair[against] === null ? 1 : Math.max(1, pair[name] / pair[against]))).sort((a, b) => a - b);
}

function pairText(pairs, one, other) {
  const both = pairs.filter((pair) => pair[one] !== null && pair[other] !== null);
  const faster = (a, b) => both.filter((pair) => pair[a] < pair[b]).length;
  const mean = Math.exp(both.reduce((sum, pair) => sum + Math.log(pair[one] / pair[other]), 0) / both.length);
  const sentence = both.length === 0 ? "No problem is solved by both."
    : `Both solve ${both.length}: ${one} is faster on ${faster(one, other)}, ${other} on ${faster(other, one)}; the geometric mean of the ratio of their times is ${mean.toPrecision(3)}.`;
  return `${sentence} Only ${one} solves ${pairs.filter((pair) => pair[other] === null).length}, only ${other} ${pairs.filter((pair) => pair[one] === null).length}.`;
}

function pairOption(pairs, one, other, title) {
  const ratios = { [one]: ratiosOf(pairs, one, other), [other]: ratiosOf(pairs, other, one) };
  const right = decade(Math.max(10, ...ratios[one], ...ratios[other]) * 1.01, Math.ceil);
  return {
    ...baseOption(`Performance profile of ${one} and ${other}, ${title}`),
    xAxis: { ...logAxis("τ: times the faster of the two"), min: 1, max: right },
    yAxis: { ...axisStyle, type: "value", min: 0, max: 1, name: "share solved within τ", nameGap: 40 },
    grid: { left: 62, right: 130, top: 14, bottom: 48 },
    series: [one, other].map((name) => lineSeries(name, staircase(ratios[name], Math.max(pairs.length, 1), right),
      { step: "end", symbolSize: 4, endLabel: { show: true, formatter: name, color: colourOf(name), fontSize: 11 }, labelLayout: { moveOverlap: "shiftY" } })),
  };
}

// At first the two with the least mean at the middle tolerance: that is what a print shows.
function writePair(one, made) {
  const taking = (at) => at.solvers.filter(({ supported }) => supported > 0);
  let at = one.tolerances[Math.floor(one.tolerances.length / 2)];
  const names = taking(at).sort((a, b) => a.mean - b.mean).map(({ solver }) => solver);
  if (names.length < 2) return;
  const members = new Set(one.members), rows = results.solves.filter((row) => members.has(row.problem + row.law));
  let pair = names.slice(0, 2);
  const place = element("div", { className: "chart" }), says = element("p", { className: "facts" }), caption = element("h4");
  const times = () => pairTimes(rows.filter((row) => row.tolerance === at.tolerance), ...pair);
  const write = () => {
    caption.textContent = `${pair[0]} against ${pair[1]}, to ${short(at.tolerance)}`;
    says.textContent = pairText(times(), ...pair);
    if (place.chart && place.chart.chart) place.chart.draw();
  };
  const chooser = (k) => selectBox(`solver ${k + 1}`, names, names.indexOf(pair[k]), (chosen) => { pair[k] = names[chosen]; write(); });
  const tolerance = selectBox("tolerance", one.tolerances.map(({ tolerance }) => short(tolerance)), one.tolerances.indexOf(at),
    (chosen) => { at = one.tolerances[chosen]; write(); });
  made.append(element("div", { className: "pair" }, element("h3", { textContent: "Two solvers" }),
    element("div", { className: "tools" }, chooser(0), chooser(1), tolerance), caption, place, says));
  addChart(place, () => pairOption(times(), ...pair, classTitles[one.name] || one.name));
  write();
}
