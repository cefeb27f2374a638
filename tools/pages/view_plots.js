// SPDX-License-Identifier: BSD-3-Clause
// The figures of all systems against time, with a line at the time that is shown.
"use strict";

const lineColours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#6a3d9a", "#4d4d4d"];

function brief(value, digits = 5) {
  if (!Number.isFinite(value)) return "—";
  if (value === 0 || (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e5)) return String(+value.toPrecision(digits));
  return value.toExponential(2);
}

// The value that was found last.
function valueAt(series, time) {
  let low = 0, high = series.t.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (series.t[middle] <= time) low = middle;
    else high = middle;
  }
  return series.values[low];
}

// One figure: a chart, its heading with the values at the time shown, and the line, which drags the time with it.
class Plot {
  constructor(name, end, onTime) {
    this.series = run.systems.map((system) => system.series.find((series) => series.name === name));
    const { unit, description } = this.series[0];
    this.unit = unit === "1" ? "" : ` ${unit}`;
    this.end = end;
    this.heading = document.createElement("figcaption");
    this.heading.append(description, (this.now = document.createElement("span")));
    this.place = document.createElement("div");
    this.line = document.createElement("div");
    this.line.className = "now";
    const figure = document.createElement("figure");
    figure.append(this.heading, this.place, this.line);
    document.getElementById("plots").append(figure);
    this.chart = echarts.init(this.place, null, { renderer: "svg" });
    this.chart.setOption(this.option(description));
    const drag = ({ offsetX, event }) => {
      if (event.buttons !== 1) return;
      onTime(Math.min(end, Math.max(0, this.chart.convertFromPixel({ xAxisIndex: 0 }, offsetX))));
    };
    this.chart.getZr().on("mousedown", drag);
    this.chart.getZr().on("mousemove", drag);
    new ResizeObserver(() => this.resize()).observe(this.place);
  }

  static worthShowing(name) {
    return run.systems.some((system) => system.series.some((series) => series.name === name && series.values.some((value) => value !== 0 && Number.isFinite(value))));
  }

  option(description) {
    const axis = { axisLine: { show: true, lineStyle: { color: "#8a929a" } }, axisLabel: { color: "#5c6670", fontSize: 11 }, splitLine: { lineStyle: { color: "#eceef1" } } };
    return {
      animation: false, aria: { enabled: true, label: { description: `${description} against time` } },
      grid: { left: 62, right: 18, top: 8, bottom: 22 },
      xAxis: { ...axis, type: "value", min: 0, max: this.end > 0 ? this.end : 1, axisLabel: { ...axis.axisLabel, formatter: (value) => brief(value, 4) } },
      yAxis: { ...axis, type: "value", scale: true, splitNumber: 3, axisLabel: { ...axis.axisLabel, formatter: (value) => brief(value, 8) } },
      series: this.series.map((series, k) => ({
        name: run.systems[k].name, type: "line", showSymbol: false, silent: true, color: lineColours[k % lineColours.length],
        lineStyle: { width: 1.4 }, data: Array.from(series.t, (t, i) => [t, Number.isFinite(series.values[i]) ? series.values[i] : null]),
      })),
    };
  }

  resize() {
    this.chart.resize();
    this.chart.getZr().flush(); // at once, not before the next picture
    this.show(this.time ?? 0);
  }

  show(time) {
    this.time = time;
    this.line.style.left = `${this.chart.convertToPixel({ xAxisIndex: 0 }, time)}px`;
    this.now.replaceChildren(...this.series.map((series, k) => {
      const value = document.createElement("b");
      value.textContent = brief(valueAt(series, time)) + this.unit;
      if (run.systems.length > 1) value.style.color = lineColours[k % lineColours.length];
      return value;
    }));
  }
}
