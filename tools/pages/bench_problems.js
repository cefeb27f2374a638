// SPDX-License-Identifier: BSD-3-Clause
// A section for each problem and law: error against time, and the table of its runs.
"use strict";

// Along the solve, the curve of the run to the tightest tolerance; at the end, a point for each tolerance.
const views = [
  { label: "natural error along the solve", measure: "natural", curve: true },
  ...results.measures.map(({ name, title }) => ({ label: `${name}: ${title} (at the end)`, measure: name, curve: false })),
];

function curveOf(row) {
  return row.curve.samples.filter(([, time, natural]) => time !== null && natural !== null).map(([iteration, time, natural]) => [
    Math.max(time, least.seconds), Math.max(natural, least.error),
    [`iteration ${whole(iteration)}`, `${seconds(time)} s`, `natural ${error(natural)}`],
  ]);
}

function endsOf(rows, measure) {
  return rows.filter((row) => row.error && row.error[measure] !== null && totalSeconds(row) !== null)
    .sort((a, b) => totalSeconds(a) - totalSeconds(b))
    .map((row) => ({
      value: [Math.max(totalSeconds(row), least.seconds), Math.max(row.error[measure], least.error)],
      symbol: solvedRow(row) ? "circle" : row.cause === "false_claim" ? "diamond" : "triangle",
      itemStyle: row.cause === "false_claim" ? { color: "#c01010" } : {},
      lines: [`asked for ${short(row.tolerance)}: ${spoken(row.cause || "solved")}`, `${seconds(totalSeconds(row))} s`,
        `${measure} ${error(row.error[measure])}`],
    }));
}

const valueOf = (point) => point.value || point;

function problemOption(rows, title, view, logarithmic) {
  const names = [...new Set(rows.map((row) => row.label))];
  const all = names.map((name) => {
    const own = rows.filter((row) => row.label === name); // one of them has samples, of the tightest tolerance it was run to
    return [name, view.curve ? own.flatMap(curveOf) : endsOf(own, view.measure), own];
  }).filter(([, data]) => data.length > 0);
  const values = all.flatMap(([, data]) => data.map(valueOf));
  const time = decades(values.map((value) => value[0]));
  const tolerances = view.measure === "natural" ? [...new Set(rows.map((row) => row.tolerance))] : [];
  const last = Math.max(...values.map((value) => value[0])) * 1.02;
  return {
    ...baseOption(`${view.label} against time on ${title}`),
    xAxis: { ...(logarithmic ? { ...logAxis("solver’s own time [s]"), ...time, minorTick: { show: true } } : { ...linearAxis("solver’s own time [s]"), min: 0, max: last }) },
    yAxis: { ...logAxis(`${view.measure} error`, 46), ...decades([...values.map((value) => value[1]), ...tolerances]) },
    series: [
      ...all.filter(([name]) => !hidden.has(name)).map(([name, data, own]) => {
        const end = own.find((row) => row.curve.samples.length > 0);
        return lineSeries(name, data, view.curve ? {
          symbolSize: 7, itemStyle: { opacity: 0 }, // samples are dense: seen, they would hide the dash; the mouse finds them
          endLabel: { show: true, formatter: end && end.cause ? `${name}: ${spoken(end.cause)}` : name, color: colourOf(name), fontSize: 11 },
          labelLayout: { moveOverlap: "shiftY" },
        } : {});
      }),
      ...tolerances.map((tolerance) => ({
        name: `tolerance ${short(tolerance)}`, type: "line", silent: true, showSymbol: false, color: "#5c6670", z: 1,
        data: [[logarithmic ? time.min : 0, tolerance], [logarithmic ? time.max : last, tolerance]], lineStyle: { type: "dashed", width: 1 },
      })),
    ],
    grid: { left: 62, right: view.curve ? 150 : 24, top: 14, bottom: 48 },
  };
}

function runsTable(rows) {
  const brief = results.measures.filter((measure) => measure.brief).map((measure) => measure.name);
  return table(["solver", "ended", "asked for", "iterations", "setup s", "solve s", ...brief, "MiB"],
    rows.map((row) => {
      const slowest = Math.max(...row.seconds.repeats.map((repeat) => repeat[1]));
      return {
        className: row.cause === "false_claim" ? "lie" : "",
        cells: [
          [swatch(row.label), row.label], statusMark(row), short(row.tolerance), whole(row.iterations), seconds(row.seconds.setup),
          [seconds(row.seconds.solve), ...(row.seconds.repeats.length > 1 ? [element("small", { textContent: ` – ${seconds(slowest)}` })] : [])],
          ...brief.map((measure) => error(row.error && row.error[measure])), mebibytes(row.peak_memory),
        ],
      };
    }), 2);
}

function referenceText(hash, law) {
  const reference = results.references.find((one) => one.of === hash && one.law === law);
  if (!reference) return "";
  if (!reference.found) return `No reference: ${reference.message}.`;
  const second = reference.second
    ? `; ${reference.second.solver} differs from it by ${error(reference.second.difference)}${reference.confirmed ? ", which confirms it" : ""}` : "";
  return `Velocities are compared with ${reference.solver}, natural error ${error(reference.natural)}${second}.${reference.confirmed ? "" : " Not confirmed: " + reference.message + "."}`;
}

function writeProblems() {
  const groups = new Map();
  for (const row of results.solves) {
    const key = row.problem + row.law;
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(row);
  }
  let number = 0;
  for (const rows of groups.values()) {
    const { problem: hash, law } = rows[0], problem = problemOf[hash];
    const cones = Object.entries(problem.cones).map(([kind, count]) => `${whole(count)} ${kind}`).join(", ");
    const taken = rows.filter((row) => row.cause !== "unsupported");
    const refused = [...new Set(rows.filter((row) => row.cause === "unsupported").map((row) => row.label))];
    const title = `${problem.name}${groups.size > results.problems.length ? ` (${law})` : ""}`;
    const place = element("div", { className: "chart" });
    let view = 0, logarithmic = true;
    const draw = () => place.chart && place.chart.chart && place.chart.draw();
    const available = views.filter((one) => taken.some((row) => (one.curve ? curveOf(row).length > 0 : endsOf([row], one.measure).length > 0)));
    const axis = element("button", { type: "button", textContent: "linear time", onclick: () => {
      logarithmic = !logarithmic;
      axis.textContent = logarithmic ? "linear time" : "logarithmic time";
      draw();
    } });
    const notes = taken.filter((row) => row.message && !skippedRow(row)).map((row) =>
      element("li", {}, element("b", { textContent: `${row.label}, ${short(row.tolerance)}: ` }), row.message));
    const made = section(`problem-${++number}`, title,
      element("p", { className: "facts", textContent:
        `n = ${whole(problem.n)}, m = ${whole(problem.m)}; ${cones ? `cones: ${cones}; ` : ""}law ${law}, H ${problem.structure}; content ${hash}; ${problem.from}` }));
    if (available.length > 0) {
      made.append(element("div", { className: "tools" }, selectBox("error measure", available.map((one) => one.label), 0, (k) => { view = k; draw(); }), axis), place);
      addChart(place, () => problemOption(taken, title, available[view], logarithmic));
    }
    made.append(element("p", { className: "facts", textContent:
      referenceText(hash, law) + (refused.length ? ` Do not take it: ${refused.join(", ")}.` : "") }));
    made.append(element("details", { open: number === 1 }, element("summary", { textContent: `${taken.length} runs` }), runsTable(taken),
      ...(notes.length ? [element("ul", { className: "notes" }, ...notes)] : [])));
  }
}
