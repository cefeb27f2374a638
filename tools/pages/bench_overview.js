// SPDX-License-Identifier: BSD-3-Clause
// Over all problems: performance profiles, means, growth with size, failures, references, libraries.
"use strict";
const classTitles = { linear: "Linear problems", unsymmetric: "Linear problems, H unsymmetric", indefinite: "Linear problems, H indefinite", associated: "Contacts, associated law", coulomb: "Contacts, exact Coulomb law", all: "All problems" };

// ρ(τ) as a staircase: it jumps by 1/problems at each ratio, and goes on to the right edge.
function staircase(ratios, problems, right) {
  const points = [[1, 0]];
  ratios.forEach((ratio, k) => points.push([ratio, (k + 1) / problems]));
  points.push([right, ratios.length / problems]);
  return points.map(([x, y], k) => [x, y, k > 0 && k <= ratios.length
    ? [`${k} of ${problems} within ${x.toPrecision(3)} times the fastest`] : [`solves ${ratios.length} of ${problems}`]]);
}

function profileOption(at, title) {
  const shown = at.solvers.filter(({ supported }) => supported > 0);
  const right = decade(Math.max(10, ...shown.flatMap(({ ratios }) => ratios)) * 1.01, Math.ceil);
  return {
    ...baseOption(`Performance profile, ${title}, at ${at.tolerance}`),
    xAxis: { ...logAxis("τ: times the fastest"), min: 1, max: right },
    yAxis: { ...axisStyle, type: "value", min: 0, max: 1, name: "share solved within τ", nameGap: 40 },
    series: shown.filter(({ solver }) => !hidden.has(solver)).map(({ solver, ratios }) =>
      lineSeries(solver, staircase(ratios, at.solved_by_any, right), { step: "end", symbolSize: 4 })),
  };
}

function meansTable(one) {
  const names = [...new Set(one.tolerances.flatMap((at) => at.solvers.map((row) => row.solver)))];
  const find = (at, name) => at.solvers.find((row) => row.solver === name);
  const rank = (name) => one.tolerances.reduce((sum, at) => sum + (find(at, name)?.mean ?? 1e9), 0);
  const best = one.tolerances.map((at) => Math.min(...at.solvers.filter((row) => row.supported && row.mean !== null).map((row) => row.mean)));
  const rows = names.filter((name) => one.tolerances.some((at) => find(at, name)?.supported > 0)).sort((a, b) => rank(a) - rank(b)).map((name) => ({
    className: one.tolerances.some((at) => find(at, name)?.false_claims > 0) ? "lie" : "",
    cells: [[swatch(name), name], ...one.tolerances.flatMap((at, k) => {
      const row = find(at, name);
      if (!row) return [missing, missing];
      return [`${row.solved} of ${row.supported}`, row.mean === best[k] ? element("b", { textContent: seconds(row.mean) }) : seconds(row.mean)];
    }), mebibytes(Math.max(...one.tolerances.map((at) => find(at, name)?.memory ?? 0)))],
  }));
  return table(["solver", ...one.tolerances.flatMap((at) => [`solved to ${short(at.tolerance)}`, "mean s"]), "most MiB"], rows);
}

function writeClasses() {
  for (const one of results.analysis.classes) {
    const title = classTitles[one.name] || one.name;
    const grid = element("div", { className: "grid" });
    const made = section(`class-${one.name}`, title, element("p", { className: "facts", textContent:
      `${plural(one.problems, "problem")}. Performance profiles, and shifted geometric means of setup and solve.` }), grid, meansTable(one));
    for (const at of one.tolerances) {
      if (at.solved_by_any === 0) continue;
      const place = element("div", { className: "chart" });
      grid.append(element("div", {}, element("h4", { textContent: `to ${short(at.tolerance)}, ${at.solved_by_any} of ${at.problems} solved by at least one` }), place));
      addChart(place, () => profileOption(at, title));
    }
    writePair(one, made);
    if (grid.children.length === 0) made.append(element("p", { textContent: "No solver solved any of them." }));
  }
}

function growthOption(series, title) {
  const shown = series.filter(({ solver }) => !hidden.has(solver));
  return {
    ...baseOption(`Cost against size, ${title}`),
    grid: { left: 62, right: 130, top: 14, bottom: 48 },
    xAxis: { ...logAxis("size: contacts, or rows"), ...decades(series.flatMap(({ points }) => points.map((point) => point[0]))) },
    yAxis: { ...logAxis("setup and solve [s]", 46), ...decades(series.flatMap(({ points }) => points.map((point) => point[1]))) },
    series: shown.map(({ solver, points, fit }) => lineSeries(solver,
      points.map(([size, time, memory]) => [size, time, [`size ${whole(size)}`, `${seconds(time)} s`, `${mebibytes(memory)} MiB`]]), {
        endLabel: { show: true, formatter: fit ? `${solver}: ${fit.exponent.toFixed(2)}` : solver, color: colourOf(solver), fontSize: 11 },
        labelLayout: { moveOverlap: "shiftY" },
      })),
  };
}

function writeGrowth() {
  const { scaling } = results.analysis;
  if (scaling.length === 0) return;
  const made = section("growth", "Growth of cost with size", element("p", { className: "facts", textContent:
    "Setup and solve of the runs that were solved. At a line’s end stands the fitted exponent p of cost ~ sizeᵖ." }));
  const groups = new Map();
  for (const one of scaling) {
    const key = `${one.family}, law ${one.law}, to ${short(one.tolerance)}`;
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(one);
  }
  for (const [title, series] of groups) {
    const place = element("div", { className: "chart" });
    made.append(element("h3", { textContent: title }), place,
      table(["solver", "exponent", "standard error", "sizes"], series.map(({ solver, fit, points }) => ({ cells: [
        [swatch(solver), solver], fit ? fit.exponent.toFixed(2) : missing, fit ? fit.standard_error.toFixed(2) : missing,
        points.map((point) => whole(point[0])).join(", ")] }))));
    addChart(place, () => growthOption(series, title));
  }
}

function writeFailures() {
  const failed = results.solves.filter((row) => row.cause && row.cause !== "unsupported" && !skippedRow(row))
    .sort((a, b) => Number(b.cause === "false_claim") - Number(a.cause === "false_claim"));
  const causes = [...new Set(results.analysis.failures.map(({ cause }) => cause))].sort();
  const names = [...new Set(results.analysis.failures.map(({ solver }) => solver))];
  if (names.length === 0) return;
  const find = (solver, cause) => results.analysis.failures.find((one) => one.solver === solver && one.cause === cause);
  const count = (solver, cause) => find(solver, cause)?.count ?? "";
  const counted = (one) => (one ? `${one.count}${one.skipped ? ` (${one.skipped} not run)` : ""}` : "");
  section("failures", "Failures",
    table(["solver", ...causes.map(spoken)], names.map((name) => ({
      className: count(name, "false_claim") ? "lie" : "",
      cells: [[swatch(name), name], ...causes.map((cause) => counted(find(name, cause)))] }))),
    element("details", {}, element("summary", { textContent: `each of the ${failed.length} that were run and are not refusals` }),
      table(["solver", "problem", "cause", "asked for", "natural", "message"], failed.map((row) => ({
        className: row.cause === "false_claim" ? "lie" : "",
        cells: [row.label, `${problemOf[row.problem].name} (${row.law})`, statusMark(row), short(row.tolerance), error(row.error && row.error.natural),
          element("span", { textContent: row.message, style: "white-space:normal" })] })), 3)));
}

function writeReferences() {
  const rows = results.references.filter((one) => problemOf[one.of]);
  if (rows.length === 0) return;
  section("references", "Reference solutions", table(["problem", "law", "solver", "natural", "second solver", "its velocities differ by", "confirmed"],
    rows.map((one) => ({ cells: [problemOf[one.of].name, one.law, one.found ? one.solver : "none: " + one.message, error(one.natural),
      one.second ? one.second.solver : missing, error(one.second && one.second.difference), one.found ? (one.confirmed ? "yes" : "no") : missing] })), 3));
}

function writeLibraries() {
  if (results.libraries.length === 0) return;
  const system = /^(ld-linux|libc\.|libm\.|libdl|libpthread|librt|libgcc_s|libstdc\+\+)/;
  section("libraries", "Libraries in the processes", element("details", {}, element("summary", { textContent: "by solver, with their versions" }),
    element("ul", { className: "notes" }, ...results.libraries.map(({ solver, version, files }) => element("li", {},
      element("b", { textContent: `${solver} ${version}: ` }), files.filter((file) => !system.test(file)).join(", "))))));
}
