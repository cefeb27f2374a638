// SPDX-License-Identifier: BSD-3-Clause
// What the reports of `delassus compare` and `delassus bench` have in common: elements, numbers, colours, axes.
"use strict";
const least = { seconds: 1e-6, error: 1e-17 }; // what logarithmic axes make of zeros
const spoken = (status) => status.replaceAll("_", " ");

const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

// How the line of a method is drawn: a colour and a dash that no other line of the page has. Both follow from the name, so that a
// method looks the same on all pages: its hash names a home. Where two names have one home, the later takes the next that is free;
// names with options, such as pgs(omega=1.2), come after those without, so that a variant displaces nobody.
// The colours are Okabe and Ito's without yellow, and purple. Two that are close to one another, for a colour-blind reader above all, have
// no dash in common among the homes: CIE76 distances with the same dash are at least 20 (Machado's simulation, 2009).
const dashes = { solid: [], dashed: [8, 4], dotted: [2, 3], dashdot: [10, 3, 2, 3] };
const homes = [
  ["#202020", "solid"], ["#cc79a7", "dashdot"], ["#e69f00", "dotted"], ["#0072b2", "dashdot"],
  ["#56b4e9", "solid"], ["#6a3d9a", "dotted"], ["#d55e00", "solid"], ["#6a3d9a", "dashed"],
  ["#cc79a7", "solid"], ["#009e73", "dashed"], ["#0072b2", "solid"], ["#009e73", "dotted"],
  ["#56b4e9", "dashdot"], ["#e69f00", "dashed"], ["#202020", "dashdot"], ["#d55e00", "dashdot"],
].map(([colour, dash]) => ({ colour, dash: dashes[dash] }));

// FNV-1a from an offset with which the names of the solvers and timesteppers at hand do not collide.
function homeOf(name) {
  let hash = 14830;
  for (const character of name) hash = Math.imul(hash ^ character.codePointAt(0), 16777619) >>> 0;
  return (hash >>> 16) % homes.length;
}

// Beyond the homes, the same colours with ever more dots after a dash; the two homes of a colour have even and odd numbers of them.
function lineStyle(place) {
  const round = Math.floor(place / homes.length), home = homes[place % homes.length];
  const dots = 2 * round + Number([dashes.dotted, dashes.dashdot].includes(home.dash));
  return round === 0 ? home : { colour: home.colour, dash: [10, 3, ...Array(dots).fill([2, 3]).flat()] };
}

// Name to { colour, dash }; dash: lengths of strokes and gaps in pixels, none for a solid line.
function lineStyles(names) {
  const plain = (name) => !name.includes("(");
  const order = [...new Set(names)].sort((a, b) => plain(b) - plain(a) || (a < b ? -1 : 1));
  const taken = new Set();
  return new Map(order.map((name) => {
    let place = homeOf(name);
    for (let tries = 1; taken.has(place); ++tries) // around the homes of this round, then of the next
      place = tries % homes.length === 0 ? homeOf(name) + tries : Math.floor(place / homes.length) * homes.length + (place + 1) % homes.length;
    taken.add(place);
    return [name, lineStyle(place)];
  }));
}

const dashType = (dash) => (dash.length === 0 ? "solid" : dash); // as ECharts has it

// A piece of the line, as it stands in legends and tables.
function swatchOf({ colour, dash }) {
  const picture = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const line = document.createElementNS(picture.namespaceURI, "path");
  const attributes = { d: "M1 5H37", stroke: colour, "stroke-width": 2.6, "stroke-dasharray": dash.join(" ") || "none", fill: "none" };
  for (const [key, value] of Object.entries(attributes)) line.setAttribute(key, value);
  picture.setAttribute("class", "swatch");
  picture.setAttribute("aria-hidden", "true");
  picture.append(line);
  return picture;
}

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
