// SPDX-License-Identifier: BSD-3-Clause
// A section for each scene: work and precision of timesteppers, and what the scene needs and does without.
"use strict";

// What a run of a scene is judged by. Energy is that of the scene's bodies; it is conserved only where nothing dissipates or drives.
const sceneMeasures = [
  { label: "position error at the end", of: (row) => row.error.position },
  { label: "velocity error at the end", of: (row) => row.error.velocity },
  { label: "change of energy [J]", of: (row) => (row.totals.energy && row.totals.energy[0] !== null && row.totals.energy[1] !== null ? Math.abs(row.totals.energy[1] - row.totals.energy[0]) : null) },
  { label: "drift of joints", of: (row) => (row.totals.drift > 0 ? row.totals.drift : null) },
  { label: "penetration [m]", of: (row) => (row.totals.penetration > 0 ? row.totals.penetration : null) },
];

function sceneOption(rows, scene, measure) {
  const names = [...new Set(rows.map((row) => row.timestepper))];
  const point = (row) => [Math.max(row.seconds.stepping, least.seconds), Math.max(measure.of(row), least.error),
    [`h = ${short(row.step)} s, ${whole(row.totals.steps)} steps`, `${seconds(row.seconds.stepping)} s`, `${measure.label}: ${error(measure.of(row))}`]];
  const all = names.map((name) => [name, rows.filter((row) => row.timestepper === name && row.totals.steps > 0 && measure.of(row) !== null)
    .sort((a, b) => b.step - a.step).map(point)]);
  const values = all.flatMap(([, data]) => data);
  const order = (name) => results.analysis.orders.find((one) => one.scene === scene.scene && one.timestepper === name)?.fit;
  return {
    ...baseOption(`${measure.label} against run time on ${scene.name}`),
    grid: { left: 62, right: 190, top: 14, bottom: 48 },
    xAxis: { ...logAxis("run time [s]"), ...decades(values.map((value) => value[0])) },
    yAxis: { ...logAxis(measure.label, 46), ...decades(values.map((value) => value[1])) },
    series: all.filter(([name, data]) => !hidden.has(name) && data.length > 0).map(([name, data]) => lineSeries(name, data, {
      endLabel: { show: true, formatter: measure === sceneMeasures[0] && order(name) ? `${name}: order ${order(name).exponent.toFixed(2)}` : name, color: colourOf(name), fontSize: 11 },
      labelLayout: { moveOverlap: "shiftY" },
    })),
  };
}

function scenesTable(rows) {
  const several = new Set(rows.map((row) => row.solver)).size > 1;
  return table(["timestepper", "ended", "step s", ...(several ? ["solver"] : []), "time s", "steps", "Newton", "position", "velocity", "energy change J", "drift", "penetration m", "MiB"],
    rows.map((row) => {
      const { totals } = row, total = (key) => totals[key] ?? null;
      return { cells: [[swatch(row.timestepper), row.timestepper], statusMark(row), short(row.step), ...(several ? [row.solver || "by need"] : []),
        seconds(row.seconds.stepping), whole(total("steps")), whole(total("newton_iterations")), error(row.error.position), error(row.error.velocity),
        totals.energy && totals.energy[0] !== null ? (totals.energy[1] - totals.energy[0]).toExponential(1) : missing, error(total("drift")), error(total("penetration")), mebibytes(row.peak_memory)] };
    }), 2);
}

const planList = (title, lines) => element("div", {}, element("b", { textContent: title }),
  element("ul", {}, ...lines.map(({ what, reason }) => element("li", {}, element("b", { textContent: what }), `: ${reason}`))));

function writeScenes() {
  results.scenes.forEach((scene, k) => {
    const rows = results.simulations.filter((row) => row.scene === scene.scene);
    if (rows.length === 0) return;
    const reference = results.references.find((one) => one.of === scene.scene);
    const made = section(`scene-${k + 1}`, `Timesteppers on ${scene.name}`, element("p", { className: "facts", textContent:
      `${scene.title}; to t = ${scene.end} s; content ${scene.scene}. ` + (reference && reference.found
        ? `Compared with ${reference.solver} at a step of ${short(reference.step)} s; twice that step differs by ${error(reference.second.position)}.`
        : reference ? `No reference: ${reference.message}.` : "") }));
    const measures = sceneMeasures.filter((measure) => rows.some((row) => row.totals.steps > 0 && measure.of(row) !== null));
    if (measures.length > 0) {
      const place = element("div", { className: "chart" });
      let measure = 0;
      made.append(element("div", { className: "tools" }, selectBox("measure", measures.map((one) => one.label), 0, (chosen) => { measure = chosen; if (place.chart.chart) place.chart.draw(); })), place);
      addChart(place, () => sceneOption(rows, scene, measures[measure]));
    }
    made.append(scenesTable(rows));
    const failed = rows.filter((row) => row.message);
    if (failed.length) made.append(element("ul", { className: "notes" }, ...failed.map((row) =>
      element("li", {}, element("b", { textContent: `${row.timestepper}, h = ${short(row.step)} s: ` }), row.message))));
    for (const system of scene.plan)
      made.append(element("h3", { textContent: `What the scene needs${scene.plan.length > 1 ? `: ${system.name}` : ""}` }),
        element("p", { className: "facts", textContent: `${system.velocities} velocities, ${system.constraints} rows of bilateral constraints; ` +
          `solvers: ${system.solvers.join(", ") || "none"}; libraries: ${system.libraries.join(", ") || "none beyond libdelassus"}` }),
        element("div", { className: "two" }, planList("kept", system.kept), planList("left out", system.left_out)));
  });
}
