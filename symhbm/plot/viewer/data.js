"use strict";
// What the page holds, and numbers and texts of it.
const data = JSON.parse(document.getElementById("data").textContent);
const ARRAYS = { f8: Float64Array, f4: Float32Array, i4: Int32Array, i1: Int8Array };
const decoded = new Map();

// An array, or that of a text with its type; each is decoded once.
function array(text) {
  if (typeof text !== "string") return text;
  if (!decoded.has(text)) {
    const kind = text.slice(0, 2), raw = atob(text.slice(3));
    const bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    decoded.set(text, new ARRAYS[kind](bytes.buffer));
  }
  return decoded.get(text);
}

// A number to the digits of the page.
function number(value) {
  if (value === null || Number.isNaN(value)) return "unknown";
  if (!Number.isFinite(value)) return value > 0 ? "infinite" : "-infinite";
  const size = Math.abs(value), far = size !== 0 && (size < 1e-4 || size >= 10 ** data.digits);
  const text = far ? value.toExponential(data.digits - 1) : value.toPrecision(data.digits);
  const [mantissa, exponent] = text.split("e");
  const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
  return exponent === undefined ? short
    : `${short}e${exponent[0]}${exponent.slice(1).padStart(2, "0")}`;
}

const withUnit = (text, units) => (units && units !== "1" ? `${text} ${units}` : text);
// Factor and unit with a prefix in which a number has one to three digits, as in pictures.
function prefixed(largest, units) {
  const known = ["m", "N", "J"].includes(units) && largest > 0 && Number.isFinite(largest);
  const power = known ? Math.min(2, Math.max(-3, Math.floor(Math.log10(largest) / 3))) : 0;
  return [10 ** (-3 * power), ["n", "µ", "m", "", "k", "M"][power + 3] + units];
}
function quantity(value, units) {
  const [factor, own] = prefixed(Math.abs(value), units || "");
  return withUnit(number(factor === 1 ? value : factor * value), own);
}
const decibel = (value) => 20 * Math.log10(value);

// Plotly reads some markup in texts: what comes from an archive has none.
const escaped = (text) =>
  String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");

// Numbers in short: 0 to 3, 7.
function ranges(list, names) {
  const parts = [];
  for (let i = 0; i < list.length; i++) {
    let j = i;
    while (j + 1 < list.length && list[j + 1] === list[j] + 1) j++;
    const few = list.slice(i, j + 1).map((k) => names[k]).join(", ");
    parts.push(j > i + 1 ? `${names[list[i]]} to ${names[list[j]]}` : few);
    i = j;
  }
  return parts.join(", ");
}

const STATES = [["stick", "--stick"], ["slip", "--slip"], ["open", "--open"],
  ["never touch", "--apart"]];

// What contacts do at a point, in words.
function contactWords(curve, i) {
  if (!curve.states) return null;
  const state = array(curve.states), n = data.contacts.length;
  const groups = STATES.map(() => []), unknown = [];
  for (let c = 0; c < n; c++) (groups[state[i * n + c]] || unknown).push(c);
  const told = (word, list) => {
    if (list.length < n) return `${word}: ${ranges(list, data.contacts)}`;
    return n > 1 ? `all ${word}` : word;
  };
  const words = STATES.map(([word], k) => groups[k].length && told(word, groups[k]))
    .filter(Boolean);
  if (unknown.length) words.push(told("without a state", unknown));
  return words.join("; ");
}

const ERRORS = {
  truncation_error: "estimated error by truncation", sampling_error: "estimated error by samples",
  condensation_error: "error of the condensation",
};
const STABLE = { "-1": "stability unknown", 0: "unstable", 1: "stable" };

function placeName(place, curve, i) {
  if (place > 0) return data.places[place - 1] || `place ${place - 1}`;
  if (!data.places.length) return "";
  if (data.places.length === 1) return data.places[0];
  const largest = curve && i >= 0 && curve.columns.largest, dof = largest && array(largest)[i];
  const which = largest ? `, ${data.places[dof] || dof}` : "";
  return `largest response${which}`;
}

// All that is told of a point of a curve, line by line.
function pointLines(curve, i, place) {
  const { x, panels } = data.layout,
    column = (name) => curve.columns[name] && array(curve.columns[name])[i];
  const lines = [`${x.title}: ${withUnit(number(array(curve.x)[i]), x.units)}`];
  for (const panel of panels) {
    const value = column(`${panel.name}:${panel.places ? place : 0}`);
    if (value === undefined) continue;
    const told = panel.scales[0] === "decibel" && value > 0;
    const level = told ? ` (${decibel(value).toFixed(3)} dB re 1 m)` : "";
    const where = panel.places && placeName(place, curve, i);
    const name = panel.places ? `amplitude${where ? ` of ${where}` : ""}` : panel.title;
    lines.push(`${name}: ${quantity(value, panel.units)}${level}`);
  }
  const contacts = contactWords(curve, i);
  if (contacts) lines.push(`contacts ${contacts}`);
  let told = false;
  for (const [name, words] of Object.entries(ERRORS)) {
    const value = column(name);
    if (value === undefined || Number.isNaN(value)) continue;
    lines.push(`${words}: ${value.toPrecision(2)}`);
    told = true;
  }
  if (!told) lines.push("no estimate of the error in the archive");
  const residual = column("residual_norm"), stability = column("stability");
  if (residual !== undefined) lines.push(`residual: ${residual.toPrecision(2)}`);
  if (stability !== undefined) lines.push(STABLE[stability] || "stability unknown");
  if (column("converged") === 0) lines.push("not converged");
  const frequency = column("frequency"), highest = column("highest_harmonic");
  if (frequency !== undefined) lines.push(`excitation frequency: ${number(frequency)} Hz`);
  if (highest >= 0) lines.push(`highest harmonic: ${highest}`);
  lines.push(`point ${array(curve.row)[i]}`);
  return lines;
}

// The value of a mark in a panel: that of its point, or the amplitude of a peak between points.
function markValue(curve, mark, panel, place) {
  const column = curve.columns && curve.columns[`${panel.name}:${panel.places ? place : 0}`];
  if (mark.what === "peak" && panel.places) {
    const own = place === 0 ? mark.leads : mark.dofs.includes(place - 1);
    if (!own) return null;
    if (mark.point < 0) return mark.y;
  }
  return column && mark.point >= 0 ? array(column)[mark.point] : null;
}

function markName(mark) {
  const of = mark.contact >= 0 ? ` of contact ${data.contacts[mark.contact] ?? mark.contact}` : "";
  if (mark.what === "point") return "the motion";
  return mark.what === "peak" ? `peak ${mark.number}, ${mark.kind}` : `${mark.kind}${of}`;
}

function markLines(curve, mark, place) {
  const { x, panels } = data.layout, lines = [markName(mark)];
  if (mark.point >= 0) return lines.concat(pointLines(curve, mark.point, place));
  lines.push(`${x.title}: ${withUnit(number(mark.x), x.units)}`);
  if (mark.what === "peak") {
    lines.push(`amplitude: ${mark.y === null ? "unbounded" : quantity(mark.y, "m")}`);
    const who = mark.dofs.map((k) => data.places[k] || k).join(", ");
    if (who) lines.push(`peaks: ${who}`);
    const error = mark.truncation_error;
    if (error) lines.push(`${ERRORS.truncation_error}: ${error.toPrecision(2)}`);
    if (mark.residual_norm) lines.push(`residual: ${mark.residual_norm.toPrecision(2)}`);
  }
  return lines;
}
