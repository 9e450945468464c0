"use strict";
// What the page holds, and numbers and texts of it.
const data = JSON.parse(document.getElementById("data").textContent);
const ARRAYS = { f8: Float64Array, f4: Float32Array, i4: Int32Array, i1: Int8Array };
const decoded = new Map();

// An array of a text with its type; each is decoded once.
function array(text) {
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
  const [mantissa, exponent] = (far ? value.toExponential(data.digits - 1) : value.toPrecision(data.digits)).split("e");
  const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
  return exponent === undefined ? short : `${short}e${exponent[0]}${exponent.slice(1).padStart(2, "0")}`;
}

const withUnit = (text, units) => (units && units !== "1" ? `${text} ${units}` : text);
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
    parts.push(j > i + 1 ? `${names[list[i]]} to ${names[list[j]]}` : list.slice(i, j + 1).map((k) => names[k]).join(", "));
    i = j;
  }
  return parts.join(", ");
}

const STATES = [["stick", "--stick"], ["slip", "--slip"], ["open", "--open"], ["never touch", "--apart"]];

// What contacts do at a point, in words.
function contactWords(curve, i) {
  if (!curve.states) return null;
  const state = array(curve.states), n = data.contacts.length, groups = STATES.map(() => []), unknown = [];
  for (let c = 0; c < n; c++) (groups[state[i * n + c]] || unknown).push(c);
  const words = STATES.map(([word], k) => [word, groups[k]]).filter(([, list]) => list.length)
    .map(([word, list]) => (list.length === n ? (n > 1 ? `all ${word}` : word) : `${word}: ${ranges(list, data.contacts)}`));
  if (unknown.length) words.push(unknown.length === n ? "without a state" : `without a state: ${ranges(unknown, data.contacts)}`);
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
  const largest = curve && curve.columns.largest;
  const which = largest && i >= 0 ? `, ${data.places[array(largest)[i]] || array(largest)[i]}` : "";
  return `largest response${which}`;
}

// All that is told of a point of a curve, line by line.
function pointLines(curve, i, place) {
  const { x, panels } = data.layout, column = (name) => curve.columns[name] && array(curve.columns[name])[i];
  const lines = [`${x.title}: ${withUnit(number(array(curve.x)[i]), x.units)}`];
  for (const panel of panels) {
    const value = column(`${panel.name}:${panel.places ? place : 0}`);
    if (value === undefined) continue;
    const level = panel.scales[0] === "decibel" && value > 0 ? ` (${decibel(value).toFixed(3)} dB re 1 m)` : "";
    const where = panel.places && placeName(place, curve, i);
    lines.push(`${panel.places ? `amplitude${where ? ` of ${where}` : ""}` : panel.title}: ${withUnit(number(value), panel.units)}${level}`);
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
  if (column("residual_norm") !== undefined) lines.push(`residual: ${column("residual_norm").toPrecision(2)}`);
  if (column("stability") !== undefined) lines.push(STABLE[column("stability")] || "stability unknown");
  if (column("converged") === 0) lines.push("not converged");
  if (column("frequency") !== undefined) lines.push(`excitation frequency: ${number(column("frequency"))} Hz`);
  if (column("highest_harmonic") >= 0) lines.push(`highest harmonic: ${column("highest_harmonic")}`);
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
    lines.push(`amplitude: ${mark.y === null ? "unbounded" : `${number(mark.y)} m`}`);
    if (mark.dofs.length) lines.push(`peaks: ${mark.dofs.map((k) => data.places[k] || k).join(", ")}`);
    if (mark.truncation_error) lines.push(`${ERRORS.truncation_error}: ${mark.truncation_error.toPrecision(2)}`);
    if (mark.residual_norm) lines.push(`residual: ${mark.residual_norm.toPrecision(2)}`);
  }
  return lines;
}
