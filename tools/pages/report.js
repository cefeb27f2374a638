// SPDX-License-Identifier: BSD-3-Clause
// Draws the page from the results that stand in it (docs/comparison.md describes them).
"use strict";
(() => {
  const results = JSON.parse(document.getElementById("results").textContent);
  const labels = [...new Set(results.problems.flatMap((problem) => problem.results.map((row) => row.label)))];
  const styles = lineStyles(labels);
  const colourOf = (label) => styles.get(label).colour;
  function writeHead() {
    const { settings, machine, build } = results;
    const rows = results.problems.flatMap((problem) => problem.results);
    const solved = results.problems.filter((problem) => problem.results.some((row) => row.status === "solved"));
    document.getElementById("summary").textContent =
      `${plural(labels.length, "solver")} on ${plural(results.problems.length, "problem")}, ` +
      `to a natural error of ${settings.tolerance.toExponential(0)} within ${settings.time_limit} s: ` +
      `${solved.length} of ${results.problems.length} solved by at least one, ` +
      `${rows.filter((row) => row.status === "solved").length} of ${rows.length} runs solved.`;
    const facts = {
      Machine: machineText(machine),
      Delassus: buildText(results.delassus, build),
      Date: results.created.replace("T", " ").replace("Z", " UTC"),
      Folder: results.folder,
      Command: results.command,
    };
    const list = document.getElementById("facts");
    for (const [name, value] of Object.entries(facts)) {
      const content = name === "Command" || name === "Folder" ? element("code", { textContent: value }) : value;
      list.append(element("dt", { textContent: name }), element("dd", {}, content));
    }
    // Beyond this, something else ran beside the measurements.
    if (machine.load > machine.cores / 2)
      list.after(element("p", { className: "warning", textContent:
        `The machine was busy when this began (load ${machine.load.toFixed(1)} on ${plural(machine.cores, "core")}): times are longer than on a quiet one.` }));
    if (results.interrupted)
      list.after(element("p", { className: "warning", textContent: "The comparison was interrupted; this is what it had reached." }));
    if (results.problems.length > 1) {
      const links = results.problems.map((problem, k) =>
        element("li", {}, element("a", { href: `#problem-${k + 1}`, textContent: problem.name })));
      document.getElementById("contents").append(element("ul", {}, ...links));
    }
  }

  function table(problem) {
    const total = (row) => row.seconds.setup + row.seconds.solve;
    const solved = problem.results.filter((row) => row.status === "solved");
    const fastest = solved.length > 1 ? solved.reduce((a, b) => (total(b) < total(a) ? b : a)) : null;
    const measures = results.measures.map((measure) => measure.name);
    const head = ["solver", "status", "iterations", "setup s", "solve s", ...measures, "MiB"];
    const body = problem.results.map((row) => {
      const slowest = Math.max(...row.seconds.repeats.map((repeat) => repeat[1]));
      const solve = element("td", { textContent: seconds(row.seconds.solve), className: row === fastest ? "best" : "" });
      if (row.seconds.repeats.length > 1) solve.append(element("small", { textContent: ` – ${seconds(slowest)}` }));
      const cells = [
        element("td", {}, swatchOf(styles.get(row.label)), row.label),
        element("td", {}, element("span", { className: `status ${row.status}`, textContent: spoken(row.status) })),
        element("td", { textContent: whole(row.iterations) }),
        element("td", { textContent: seconds(row.seconds.setup) }),
        solve,
        ...measures.map((key) =>
          element("td", { textContent: error(row.error && row.error[key]) })),
        element("td", { textContent: mebibytes(row.peak_memory) }),
      ];
      return element("tr", {}, ...cells);
    });
    return element("div", { className: "scroll" },
      element("table", {},
        element("thead", {}, element("tr", {}, ...head.map((textContent) => element("th", { textContent })))),
        element("tbody", {}, ...body)));
  }

  function notes(problem) {
    const items = problem.results.filter((row) => row.message).map((row) =>
      row.status === "unsupported" ? element("li", { textContent: row.message })
        : element("li", {}, element("b", { textContent: row.label + ": " }), row.message));
    if (problem.velocity_reference)
      items.push(element("li", { textContent: `Velocities are compared with those of ${problem.velocity_reference}.` }));
    return items.length ? element("ul", { className: "notes" }, ...items) : "";
  }

  // The natural error never falls below its clip, nor time; the true values stay in the third and fourth place.
  const points = (row) => row.curve.samples
    .filter(([, time, natural]) => time !== null && natural !== null)
    .map(([iteration, time, natural]) =>
      [Math.max(time, least.seconds), Math.max(natural, least.error), time, natural, iteration]);

  const ending = (row) => (row.status === "solved" ? row.label : `${row.label}: ${spoken(row.status)}`);
  const symbols = { solved: "circle", unsupported: "none", crashed: "triangle", hung: "triangle", false_claim: "diamond" };

  function option(problem, logarithmic) {
    const rows = problem.results.filter((row) => points(row).length > 0);
    const series = rows.map((row) => {
      const data = points(row);
      const end = data[data.length - 1];
      return {
        name: row.label, type: "line", data, color: colourOf(row.label), animation: false, symbol: "none",
        lineStyle: { width: 1.8, type: dashType(styles.get(row.label).dash) }, emphasis: { disabled: true },
        endLabel: { show: true, formatter: ending(row), color: colourOf(row.label), fontSize: 11, distance: 10 },
        labelLayout: { moveOverlap: "shiftY" },
        markPoint: {
          animation: false, symbol: symbols[row.status] || "rect", symbolSize: 10,
          itemStyle: { borderColor: "#fff", borderWidth: 1 },
          data: [{ coord: [end[0], end[1]], name: row.status }],
          label: { show: false },
        },
      };
    });
    const { tolerance } = results.settings;
    const all = rows.flatMap(points);
    const low = Math.min(tolerance, ...all.map((point) => point[1]));
    const high = Math.max(tolerance, ...all.map((point) => point[1]));
    const first = Math.min(...all.map((point) => point[0])), last = Math.max(...all.map((point) => point[0]));
    const left = logarithmic ? decade(first, Math.floor) : 0;
    const right = logarithmic ? decade(last * 1.02, Math.ceil) : last * 1.02;
    const xAxis = logarithmic
      ? { type: "log", min: left, max: right, axisLabel: { formatter: power }, minorTick: { show: true } }
      : { type: "value", min: left, max: right, axisLabel: { showMaxLabel: false, formatter: (value) => String(+value.toPrecision(6)) } };
    // A series of its own: the line stays when all solvers are switched off.
    series.push({
      name: "tolerance", type: "line", animation: false, silent: true, showSymbol: false, color: "#5c6670", z: 1,
      data: [[left, tolerance], [right, tolerance]],
      lineStyle: { type: "dashed", width: 1.2 }, labelLayout: { moveOverlap: "shiftY" },
      endLabel: { show: true, formatter: `tolerance ${tolerance.toExponential(0)}`, color: "#5c6670", fontSize: 11 },
    });
    const longest = Math.max(14, ...rows.map((row) => ending(row).length));
    return {
      animation: false, textStyle: { fontFamily: getComputedStyle(document.body).fontFamily, color: "#1d2329" },
      aria: { enabled: true, label: { description: `Natural error against time on ${problem.name}` } },
      grid: { left: 68, right: Math.min(260, 20 + 6.4 * longest), top: 44, bottom: 52 },
      legend: { top: 4, left: 0, right: 150, type: "scroll", itemWidth: 38, itemHeight: 14, itemStyle: { opacity: 0 }, itemGap: 18, data: rows.map((row) => row.label) },
      xAxis: { ...axisStyle, ...xAxis, name: "solver’s own time [s]", nameGap: 32 },
      yAxis: { ...axisStyle, type: "log", name: "natural error", nameGap: 50, min: decade(low, Math.floor), max: decade(high * 1.5, Math.ceil),
               axisLabel: { formatter: power } },
      series,
    };
  }

  const page = document.documentElement;
  const drawn = { charts: 0, series: 0 };

  function draw(problem, place, logarithmic) {
    const chart = echarts.init(place, null, { renderer: "svg" });
    const rows = problem.results.filter((row) => points(row).length > 0);
    let counted = false;
    chart.on("finished", () => {
      if (counted) return;
      counted = true;
      drawn.charts += 1;
      drawn.series += rows.length;
      page.dataset.chartsDrawn = drawn.charts;
      page.dataset.seriesDrawn = drawn.series;
    });
    chart.setOption(option(problem, logarithmic));
    // Curves are dense and their symbols hidden: the nearest sample of any curve answers to the mouse.
    const tip = element("div", { className: "tip", hidden: true }), dot = element("div", { className: "dot", hidden: true });
    place.append(dot, tip);
    const hide = () => { tip.hidden = dot.hidden = true; };
    chart.getZr().on("globalout", hide);
    chart.getZr().on("mousemove", ({ offsetX, offsetY }) => {
      const selected = chart.getOption().legend[0].selected || {};
      let nearest = null, best = 20 * 20;
      rows.forEach((row, seriesIndex) => {
        if (selected[row.label] === false) return;
        for (const point of points(row)) {
          const [x, y] = chart.convertToPixel({ seriesIndex }, [point[0], point[1]]);
          const distance = (x - offsetX) ** 2 + (y - offsetY) ** 2;
          if (distance < best) [best, nearest] = [distance, { row, point, x, y }];
        }
      });
      if (!nearest) return hide();
      const { row, point, x, y } = nearest;
      tip.replaceChildren(element("b", { textContent: row.label, style: `color:${colourOf(row.label)}` }),
        `iteration ${whole(point[4])}`, element("br"), `${seconds(point[2])} s`, element("br"), `natural ${error(point[3])}`);
      tip.hidden = dot.hidden = false;
      dot.style.cssText = `left:${x - 5}px;top:${y - 5}px;background:${colourOf(row.label)}`;
      tip.style.left = `${x + 14 + tip.offsetWidth > place.clientWidth ? x - 14 - tip.offsetWidth : x + 14}px`;
      tip.style.top = `${Math.max(0, y - tip.offsetHeight - 8)}px`;
    });
    return chart;
  }

  function write(problem, k) {
    const cones = Object.entries(problem.cones).map(([kind, count]) => `${whole(count)} ${kind}`).join(", ");
    const section = element("section", { id: `problem-${k + 1}` },
      element("h2", { textContent: problem.name }),
      element("p", { className: "facts", textContent:
        `n = ${whole(problem.n)}, m = ${whole(problem.m)}; ${cones ? `cones: ${cones}; ` : ""}law ${problem.law}, H ${problem.structure}` }));
    document.getElementById("problems").append(section);
    if (problem.results.some((row) => points(row).length > 0)) {
      const axis = element("button", { type: "button", textContent: "linear time" });
      const place = element("div", { className: "chart" });
      section.append(element("div", { className: "tools" }, axis), place);
      let logarithmic = true;
      const chart = draw(problem, place, logarithmic);
      axis.onclick = () => {
        logarithmic = !logarithmic;
        axis.textContent = logarithmic ? "linear time" : "logarithmic time";
        const selected = chart.getOption().legend[0].selected;
        chart.setOption(option(problem, logarithmic), true);
        chart.setOption({ legend: { selected } });
      };
      addEventListener("resize", () => chart.resize());
      addEventListener("beforeprint", () => chart.resize());
    } else {
      section.append(element("p", { className: "facts", textContent: "No solver gave an iterate, so there is no curve." }));
    }
    section.append(table(problem), notes(problem));
  }

  writeHead();
  results.problems.forEach(write);
})();
