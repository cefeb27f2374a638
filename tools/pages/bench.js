// SPDX-License-Identifier: BSD-3-Clause
// Puts the report of `delassus bench` together (docs/benchmarks.md describes the results that stand in it).
"use strict";
(() => {
  const { session } = results;
  const at = (id) => document.getElementById(id);

  function writeHead() {
    document.title = `${session.suite.title} – Delassus benchmark`;
    at("title").textContent = `Benchmark: ${session.suite.title}`;
    const asked = results.solves.filter((row) => row.cause !== "unsupported");
    at("summary").textContent = (session.suite.description ? `${session.suite.description}. ` : "") + [
      results.solves.length === 0 ? "" : `${plural(solverLabels.length, "solver")} on ${plural(new Set(results.solves.map((row) => row.problem)).size, "problem")}: ` +
        `${asked.filter(solvedRow).length} of ${asked.length} runs solved, ${results.solves.length - asked.length} refused`,
      results.simulations.length === 0 ? "" : `${plural(results.simulations.length, "run")} of ${plural(results.scenes.length, "scene")}`,
      results.leaving_out.length === 0 ? "" : `${plural(results.leaving_out.length, "scene")} with and without leaving out`,
      results.cells.length === 0 ? "" : `${results.cells.filter((cell) => cell.outcome === "correct").length} of ${plural(results.cells.length, "cell")} correct on ${results.axes.length} axes`,
    ].filter(Boolean).join("; ") + ".";
    const { settings, machine, build } = session;
    const { ratio, runs } = results.analysis.recording;
    const facts = {
      Machine: machineText(machine),
      Delassus: `${buildText(session.delassus, build)}; content ${session.code}`,
      Limits: `${settings.time_limit} s, ${settings.memory_limit ? settings.memory_limit + " MiB resident" : "memory not limited"}, ${plural(session.threads, "thread")}, least of ${settings.repeats} repeats`,
      Date: session.created.replace("T", " ").replace("Z", " UTC"),
      Suite: `${session.suite.file}, content ${session.suite.hash}`,
      ...(ratio === null ? {} : { Recording: `taking the error along the way, and being the first, made a solve ${ratio.toFixed(2)} times as long (median of ${runs} runs over 10 ms)` }),
    };
    for (const [name, value] of Object.entries(facts)) at("facts").append(element("dt", { textContent: name }), element("dd", { textContent: value }));
    const warn = (text) => at("facts").after(element("p", { className: "warning", textContent: text }));
    if (machine.load > machine.cores / 2)
      warn(`The machine was busy when this began (load ${machine.load.toFixed(1)} on ${plural(machine.cores, "core")}): times are longer than on a quiet one.`);
    if (results.missing > 0) warn(`${results.missing} runs are missing: the benchmark was interrupted. The same command goes on from there.`);
    for (const sentence of session.left_out) warn(`Left out: ${sentence}.`);
    const wrong = results.cells.filter((cell) => ["wrong", "crashed", "hung"].includes(cell.outcome));
    if (wrong.length > 0)
      at("facts").after(element("p", { className: "warning status false_claim", textContent:
        `Wrong, crashed or hung on an axis: ${[...new Set(wrong.map((cell) => cell.method))].join(", ")}, in ${plural(wrong.length, "cell")}.` }));
    const lies = results.solves.filter((row) => row.cause === "false_claim");
    if (lies.length > 0)
      at("facts").after(element("p", { className: "warning status false_claim", textContent:
        `False claims of convergence: ${[...new Set(lies.map((row) => row.label))].join(", ")}, in ${plural(lies.length, "run")}.` }));
    at("folder").textContent = session.folder;
    at("command").textContent = session.command;
    at("contents").append(element("ul"));
  }

  function writeLegend() {
    for (const name of seriesNames) {
      const button = element("button", { type: "button", onclick: () => toggle(name) }, swatch(name), name);
      button.dataset.name = name;
      button.setAttribute("aria-pressed", "true");
      at("legend").append(button);
    }
  }

  writeHead();
  writeLegend();
  writeAxes();
  writeClasses();
  writeGrowth();
  writeProcesses();
  writeScenes();
  writeLeavingOut();
  writeProblems();
  writeFailures();
  writeReferences();
  writeLibraries();
  addEventListener("resize", () => charts.forEach(({ chart }) => chart && chart.resize()));
  addEventListener("beforeprint", () => {
    for (const details of document.querySelectorAll("details")) details.open = true;
    for (const entry of charts) {
      if (!entry.chart) entry.draw();
      entry.chart.resize();
    }
  });
  document.documentElement.dataset.sections = document.querySelectorAll("section").length;
})();
