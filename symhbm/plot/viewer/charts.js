// Figures of plotly from what the page holds.
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const SYMBOLS = {
  "smooth": "circle", "corner": "triangle-up", "fold": "square", "branch point": "diamond",
  "phase resonance": "triangle-left", "period doubling": "triangle-down", "Neimark-Sacker": "cross",
  "symmetry breaking": "x", "change of stability": "x", "damping turns": "diamond",
  "onset of slip": "triangle-right", "end of slip": "triangle-right-open",
  "opening": "hexagon-open",
  "closing": "hexagon", "contact": "hexagon",
};
// Without the button of plotly that sends a figure to its makers.
const CONFIG = {
  responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "",
  modeBarButtonsToRemove: ["lasso2d", "select2d", "autoScale2d", "sendChartToCloud"],
};
const MOST_OTHERS = 60;
const narrow = () => window.innerWidth < 700;

function baseLayout(extra) {
  const axis = {
    gridcolor: css("--rule"), linecolor: css("--soft"), zeroline: false, automargin: true,
    exponentformat: "power", ticks: "outside", tickcolor: css("--rule"),
  };
  const layout = {
    paper_bgcolor: css("--ground"), plot_bgcolor: css("--ground"), hovermode: "closest",
    hoverdistance: 24,
    font: { family: "system-ui, sans-serif", size: narrow() ? 11 : 13, color: css("--ink") },
    margin: { l: narrow() ? 48 : 64, r: 14, t: 34, b: 48 }, showlegend: true, dragmode: "zoom",
    legend: { orientation: "h", x: 0, y: 1.01, yanchor: "bottom",
      font: { size: narrow() ? 10 : 12 } },
    hoverlabel: { align: "left", bgcolor: css("--panel"), bordercolor: css("--soft"),
      font: { color: css("--ink"), size: 12 } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: css("--soft"), activecolor: css("--accent") },
    ...extra,
  };
  for (const key of Object.keys(layout).filter((name) => /^[xy]axis/.test(name)))
    layout[key] = { ...axis, ...layout[key] };
  return layout;
}

const shownValue = (value, scale) => (scale === "decibel" ? decibel(value) : value);
const axisTitle = (title, units, scale) =>
  escaped(scale === "decibel" ? `${title} [dB re 1 m]` : units ? `${title} [${units}]` : title);
const text = (lines) => lines.map(escaped).join("<br>");

// The points of a line of a panel, and whether each piece after them is unstable.
function lineOf(curve, panel, place, scale) {
  const own = panel.places && curve.lines && curve.lines[place];
  if (own) {
    const level = array(own.y), unstable = own.unstable ? array(own.unstable) : null;
    const y = scale === "decibel" ? [...level] : Array.from(level, (v) => 10 ** (v / 20));
    return { x: [...array(own.x)], y, unstable };
  }
  const column = curve.columns && curve.columns[`${panel.name}:${panel.places ? place : 0}`];
  if (!column) return null;
  const value = array(column), y = Array.from(value, (v) => shownValue(v, scale)),
    x = [...array(curve.x)];
  const branch = curve.columns.cycle_branch && array(curve.columns.cycle_branch);
  const stable = curve.columns.stability && array(curve.columns.stability);
  const each = (told) => Int8Array.from({ length: Math.max(0, x.length - 1) }, (_, i) => told(i));
  // Branches are apart. What is not known at one end alone, as at a fold, is told by the other.
  return {
    x, y, apart: branch && each((i) => branch[i] !== branch[i + 1]),
    unstable: stable && each((i) => stable[i] === 0 || stable[i + 1] === 0),
    unknown: stable && each((i) => stable[i] === -1 && stable[i + 1] === -1),
  };
}

// The pieces of a line that are chosen, with gaps between them.
function pieces(line, chosen) {
  const x = [], y = [];
  for (let i = 0; i + 1 < line.x.length; i++) {
    if (!chosen(i) || (line.apart && line.apart[i])) continue;
    if (x.length && x[x.length - 1] === line.x[i] && y[y.length - 1] === line.y[i]) {
      x.push(line.x[i + 1]); y.push(line.y[i + 1]);
    } else {
      if (x.length) { x.push(null); y.push(null); }
      x.push(line.x[i], line.x[i + 1]); y.push(line.y[i], line.y[i + 1]);
    }
  }
  return { x, y };
}

// The figure of the chosen curve: panels over one axis, and what contacts do below.
function curveFigure(curve, chosen) {
  const { x, panels, joined } = data.layout, traces = [], rows = stateRows(curve);
  const share = rows.length ? Math.min(0.4, 0.1 + 0.022 * rows.length) : 0;
  const layout = { xaxis: {
    title: { text: axisTitle(x.title, x.units) }, type: chosen.x === "log" ? "log" : "linear",
    anchor: rows.length ? "y9" : panels.length > 1 ? `y${panels.length}` : "y",
  } };
  const room = 1 - share - (share ? 0.05 : 0), height = room / panels.length;
  panels.forEach((panel, p) => {
    const scale = p ? panel.scales[0] : chosen.scale, axis = p ? `y${p + 1}` : "y",
      place = panel.places ? chosen.place : 0;
    const title = panel.places ? placeName(place) || panel.title : panel.title;
    layout[p ? `yaxis${p + 1}` : "yaxis"] = {
      title: { text: axisTitle(title, panel.units, scale), standoff: 8 },
      type: scale === "log" ? "log" : "linear",
      domain: [1 - (p + 1) * height + (p + 1 < panels.length ? 0.04 : 0), 1 - p * height],
      rangemode: scale === "linear" && panel.places ? "tozero" : "normal",
    };
    const add = (trace) => traces.push({
      yaxis: axis, hoverinfo: "skip", showlegend: p === 0, ...trace });
    if (chosen.others) addOthers(add, curve, panel, place, scale, joined);
    if (!curve.columns) return;
    const line = joined && lineOf(curve, panel, place, scale);
    if (line) {
      const told = (name, i) => Boolean(line[name] && line[name][i]);
      const parts = [
        ["curve", "solid", (i) => !told("unstable", i) && !told("unknown", i)],
        ["unstable", "dot", (i) => told("unstable", i)],
          ["stability unknown", "dash", (i) => told("unknown", i)],
      ];
      for (const [name, dash, chosenPieces] of parts) {
        const part = pieces(line, chosenPieces);
        const look = { color: css("--line"), width: dash === "solid" ? 2 : 1.5, dash };
        if (part.x.length || name === "curve") add({ ...part, mode: "lines", name, line: look });
      }
    }
    const column = curve.columns[`${panel.name}:${place}`];
    const measured = curve.measured && curve.measured[`${panel.name}:${place}`];
    if (measured) add({
      x: [...array(measured.x)], y: Array.from(array(measured.y), (v) => shownValue(v, scale)),
      mode: "markers", name: "measured", hoverinfo: "x+y",
      marker: { symbol: "circle-open", color: css("--mark"), size: 8, line: { width: 1.5 } },
    });
    if (!column) return;
    const values = array(column), at = array(curve.x), hover = [];
    // A point that is marked is told by its mark.
    const shown = (mark) => markValue(curve, mark, panel, chosen.place) !== null;
    const marked = new Set(curve.marks.filter(shown).map((mark) => mark.point));
    for (let i = 0; i < at.length; i++) hover.push(text(pointLines(curve, i, chosen.place)));
    add({
      x: [...at], y: Array.from(values, (v, i) => (marked.has(i) ? null : shownValue(v, scale))),
      mode: "markers", name: "points", hoverinfo: "text",
      text: hover, meta: "points",
      marker: { color: css("--line"), size: joined ? 5 : 6, opacity: 0.75 },
    });
  });
  panels.forEach((panel, p) => addMarks(traces, curve, panel, p, chosen));
  layout.yaxis8 = { overlaying: "y", range: [0, 1], visible: false, fixedrange: true };
  if (rows.length) addStates(traces, layout, curve, rows, share, chosen);
  return { traces, layout: baseLayout(layout) };
}

function addOthers(add, curve, panel, place, scale, joined) {
  const x = [], y = [];
  const others = data.curves.filter((other) => other !== curve && other.columns);
  others.slice(0, MOST_OTHERS).forEach((other) => {
    const line = lineOf(other, panel, place, scale);
    if (!line) return;
    x.push(...line.x, null); y.push(...line.y, null);
  });
  if (x.length) add({
    x, y, mode: joined ? "lines" : "markers", name: "other sets", opacity: 0.6,
    line: { color: css("--other"), width: 1 }, marker: { color: css("--other"), size: 3 },
  });
}

function addMarks(traces, curve, panel, p, chosen) {
  const kinds = new Map(), scale = p ? panel.scales[0] : chosen.scale, lost = [];
  curve.marks.forEach((mark, k) => {
    const value = markValue(curve, mark, panel, chosen.place);
    if (value === null || !Number.isFinite(value)) {
      if (mark.what === "peak" && mark.y === null) lost.push(mark.x);
      return;
    }
    const empty = { x: [], y: [], text: [], customdata: [], what: mark.what };
    if (!kinds.has(mark.kind)) kinds.set(mark.kind, empty);
    const trace = kinds.get(mark.kind);
    trace.x.push(mark.x); trace.y.push(shownValue(value, scale));
    trace.text.push(text(markLines(curve, mark, chosen.place))); trace.customdata.push(k);
  });
  for (const [kind, { what, ...trace }] of kinds) traces.push({
    ...trace, yaxis: p ? `y${p + 1}` : "y", mode: "markers", hoverinfo: "text", meta: "marks",
    showlegend: p === 0,
    name: escaped(what === "peak" ? `peak, ${kind}` : kind),
    marker: {
      symbol: SYMBOLS[kind] || "star-diamond", size: what === "peak" ? 11 : 9,
      color: what === "peak" ? css("--mark") : css("--slip"),
      line: { color: css("--ink"), width: 1 },
    },
  });
  lost.forEach((at) => traces.push({
    x: [at, at], y: [0, 1], yaxis: "y8", mode: "lines", name: "unbounded peak", hoverinfo: "name",
    line: { color: css("--mark"), dash: "dot", width: 1 },
  }));
  const mark = curve.marks[chosen.mark],
    value = mark && markValue(curve, mark, panel, chosen.place);
  if (mark && value !== null && Number.isFinite(value)) traces.push({
    x: [mark.x], y: [shownValue(value, scale)], yaxis: p ? `y${p + 1}` : "y", mode: "markers",
    hoverinfo: "skip", showlegend: false,
    marker: { symbol: "circle-open", size: 20, color: css("--mark"), line: { width: 2.5 } },
  });
}

// A panel of a picture: its items in their order, amplitudes in the chosen scale.
function panelFigure({ x, y, items }, scale, wide) {
  const traces = [], level = scale === "decibel", label = level
    ? y.label.replace("[", "[dB re 1 ") : y.label;
  const paint = (color) => (color === "black" ? css("--ink") : color.startsWith("0.")
    ? `rgba(${css("--band")},${(1.1 - color).toFixed(2)})` : color);
  for (const item of items) {
    const [at = [null], ...values] = item.data.map((each) => [...array(each)]),
      name = escaped(item.label);
    const sides = values.map((each) => (level ? each.map(decibel) : each));
    const of = (k) => text([item.label, item.names && item.names[k],
      `${x.label}: ${number(at[k])}`, ...values.map((each) => `${y.label}: ${number(each[k])}`),
    ].filter(Boolean));
    const look = { color: paint(item.color), width: item.linewidth || 1.4, dash: item.dash };
    const trace = (side, more) => traces.push({ x: at, y: side, name, hoverinfo: "text",
      text: at.map((_, k) => of(k)), mode: "lines", showlegend: Boolean(item.label), ...more });
    if (item.kind === "band") {
      trace(sides[0], { line: { width: 0 }, showlegend: false });
      trace(sides[1], { line: { width: 0 }, fill: "tonexty", fillcolor: look.color });
    } else if (item.kind === "line") trace(sides[0], {
      mode: item.dash ? item.marker ? "lines+markers" : "lines" : "markers",
      line: { ...look, shape: item.drawstyle ? "hv" : "linear" },
      marker: { color: look.color, size: at.length > 200 ? 3 : 6 },
    });
    else trace([null]);
  }
  const axis = ({ log, limits }, words) => ({ title: { text: escaped(words), standoff: 8 },
    type: log ? "log" : "linear", ...(limits && !log && { range: limits }) });
  return { traces, layout: baseLayout({
    xaxis: axis({ ...x, log: wide === undefined ? x.log : wide }, x.label),
    yaxis: axis(level || scale === "linear" ? { ...y, log: false } : y, label),
  }) };
}

// Loops of one contact at a mark.
function loopFigure(motion, contact) {
  const loop = motion.loops[contact], names = (data.directions[contact] || []), items = [];
  loop.u.forEach((side, k) => {
    const label = names[k] || `direction ${k}`, u = array(side),
      ends = [Math.min(...u), Math.max(...u)];
    items.push({ kind: "line", color: css("--line"), linewidth: 2, label,
      dash: ["solid", "dash", "dot"][k % 3], data: [side, loop.f[k]] });
    if (loop.limit && label === "tangential") for (const sign of [-1, 1]) items.push({
      kind: "line", color: css("--soft"), linewidth: 1, dash: "dot",
      label: sign > 0 ? "limit of slip" : "",
      data: [ends, ends.map(() => sign * loop.limit)] });
  });
  const inUnits = (side, units) => {
    const every = items.flatMap((item) => [...array(item.data[side])]).filter(Number.isFinite);
    const [factor, own] = prefixed(Math.max(...every.map(Math.abs)), units);
    items.forEach((item) => {
      item.data[side] = Array.from(array(item.data[side]), (value) => factor * value);
    });
    return own;
  };
  const [moved, pushed] = [inUnits(0, "m"), inUnits(1, "N")];
  return panelFigure({ items, x: { label: `relative displacement [${moved}]` },
    y: { label: `contact force [${pushed}]` } });
}

// The shape of a motion: around the disk, or place by place.
function shapeFigure(motion) {
  const { shape } = motion, size = array(shape.amplitude), instant = array(shape.instant);
  const hover = (k) => text([data.places[k] || `place ${k}`, `amplitude: ${quantity(size[k], "m")}`,
    `displacement: ${quantity(instant[k], "m")}`]);
  const [factor, units] = prefixed(Math.max(...size), "m");
  if (!shape.blades) {
    const x = Array.from(size, (_, k) => k), names = x.map((k) => escaped(data.places[k] || k));
    return { traces: [
      { x, y: Array.from(size, (v) => factor * v), type: "bar", name: "amplitude",
        marker: { color: `rgba(${css("--band")},0.3)` }, hoverinfo: "text",
        hovertext: x.map(hover) },
      { x, y: Array.from(instant, (v) => factor * v), mode: "markers", name: "at the instant of the largest",
        marker: { color: css("--mark"), size: 8 }, hoverinfo: "skip" },
    ], layout: baseLayout({
      xaxis: x.length > 30 ? { title: { text: "place" } } : { tickvals: x, ticktext: names },
      yaxis: { title: { text: `displacement [${units}]` } },
    }) };
  }
  const blades = shape.blades, top = Math.max(...blades.map((k) => size[k])) || 1, rest = 1,
    reach = 0.4;
  const turn = blades.map((_, i) => 360 * i / blades.length), closed = (list) => [...list, list[0]];
  const told = blades.map((_, i) => i).filter((i) => i % Math.ceil(blades.length / 40) === 0);
  const ring = Array.from({ length: 73 }, (_, i) => 5 * i);
  const trace = (r, more) => ({
    type: "scatterpolar", theta: closed(turn), r: closed(r), mode: "lines", hoverinfo: "skip",
    ...more });
  return { traces: [
    { type: "scatterpolar", theta: ring, r: ring.map(() => rest), mode: "lines", hoverinfo: "skip",
      name: "at rest", line: { color: css("--other"), dash: "dash", width: 1 } },
    trace(blades.map((k) => rest + reach * size[k] / top),
      { name: "extremes", line: { color: css("--other"), width: 1 } }),
    trace(blades.map((k) => rest - reach * size[k] / top),
      { showlegend: false, line: { color: css("--other"), width: 1 } }),
    trace(blades.map((k) => rest + reach * instant[k] / top), {
      name: "at the instant of the largest", mode: "lines+markers", hoverinfo: "text",
      text: closed(blades.map(hover)),
      line: { color: css("--line"), width: 2 }, marker: { color: css("--mark"), size: 8 },
    }),
  ], layout: baseLayout({
    margin: { l: 30, r: 30, t: 70, b: 30 },
    legend: { orientation: "h", x: 0, y: 1.1, yanchor: "bottom" },
    polar: {
      bgcolor: css("--ground"), radialaxis: { visible: false, range: [0, 1.5] },
      angularaxis: {
        rotation: 90, direction: "clockwise", gridcolor: css("--rule"), linecolor: css("--rule"),
        tickvals: told.map((i) => turn[i]), ticktext: told,
      },
    },
  }) };
}
