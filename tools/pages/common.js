// SPDX-License-Identifier: BSD-3-Clause
// What the reports of `delassus compare` and `delassus bench` have in common: elements, numbers, colours, axes.
"use strict";
const least = { seconds: 1e-6, error: 1e-17 }; // what logarithmic axes make of zeros
// Okabe and Ito's colours, which stay apart for colour-blind readers, and three more.
const colours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#6a3d9a", "#4d4d4d", "#a6761d", "#8a8a00"];
const spoken = (status) => status.replaceAll("_", " ");

const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

const missing = "—";
const error = (value) => (value === null || value === undefined ? missing : value === 0 ? "0" : value.toExponential(2));
const seconds = (value) =>
  value === null ? missing : value === 0 ? "0" : value < 1e-4 ? value.toExponential(1) : value.toPrecision(3);
const whole = (value) => (value === null ? missing : value.toLocaleString("en").replaceAll(",", "\u202f"));
const mebibytes = (value) => (value > 0 ? (value / 1048576).toFixed(1) : missing);
const power = (value) => {
  const exponent = Math.round(Math.log10(value));
  const raised = String(exponent).replace(/[-0-9]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));
  return Math.abs(value / 10 ** exponent - 1) < 1e-6 ? "10" + raised : value.toPrecision(2);
};
// Minus the exponent of a plain number: 1e-6, 0.002.
const short = (value) => (value !== 0 && (Math.abs(value) < 1e-2 || Math.abs(value) >= 1e5) ? value.toExponential().replace("e+", "e") : String(value));
const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
const decade = (value, round) => 10 ** round(Math.log10(value));
const axisStyle = {
  nameLocation: "middle", nameTextStyle: { color: "#5c6670" }, axisLine: { show: true, lineStyle: { color: "#1d2329" } },
  splitLine: { lineStyle: { color: "#e8ebee" } }, minorSplitLine: { show: false },
};
const machineText = (machine) =>
  `${machine.processor}, ${plural(machine.cores, "core")}, ${(machine.memory / 2 ** 30).toFixed(1)} GiB; ${machine.system}`;
const buildText = (version, build) =>
  `${version}, ${build.type || "no"} build, ${build.compiler}${build.flags ? ", " + build.flags : ""}`;
