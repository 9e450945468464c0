// What contacts do along a curve: a row for each, below the panels.
const MOST_ROWS = 40;

// The contacts with a row of their own: all with a state, or those that change it.
function stateRows(curve) {
  const n = data.contacts.length;
  if (!curve.states || !n || !data.layout.joined) return [];
  const state = array(curve.states), all = Array.from({ length: n }, (_, c) => c);
  const points = Array.from({ length: state.length / n }, (_, i) => i * n);
  const some = (c, has) => points.some((start) => has(start + c));
  const known = all.filter((c) => some(c, (i) => state[i] >= 0));
  if (known.length <= MOST_ROWS) return known;
  return known.filter((c) => some(c, (i) => i >= n && state[i] !== state[i - n]))
    .slice(0, MOST_ROWS);
}

// What contacts do along the curve: each way of a path that folds has a part of the row.
function addStates(traces, layout, curve, rows, share, chosen) {
  const x = array(curve.x), state = array(curve.states), n = data.contacts.length;
  const way = [0];
  let step = 0;
  for (let i = 0; i + 1 < x.length; i++) {
    const next = Math.sign(x[i + 1] - x[i]);
    way.push(way[i] + (next && step && next !== step ? 1 : 0));
    if (next) step = next;
  }
  const ways = Math.min(6, way.length ? way[way.length - 1] + 1 : 1);
  const tall = (narrow() ? 430 : 520) * share / rows.length;
  const parts = STATES.map(() => ({ x: [], y: [] }));
  const add = (k, from, to, y) => {
    const part = parts[k];
    if (!part || from === to) return;
    const end = part.x.length - 2;
    // What goes on in the same way is one piece.
    if (end >= 0 && part.x[end] === from && part.y[end] === y) part.x[end] = to;
    else { part.x.push(from, to, null); part.y.push(y, y, null); }
  };
  rows.forEach((c, row) => {
    const events = curve.marks.filter((mark) => mark.what === "event" && mark.contact === c)
      .map((mark) => mark.x);
    for (let i = 0; i + 1 < x.length; i++) {
      const here = state[i * n + c], there = state[(i + 1) * n + c],
        low = Math.min(x[i], x[i + 1]), high = Math.max(x[i], x[i + 1]);
      const inside = events.filter((at) => at >= low && at <= high);
      const border = here === there ? x[i + 1] : inside.length ? inside[0] : (x[i] + x[i + 1]) / 2;
      const y = row + (ways > 1 ? ((way[i + 1] % ways) - (ways - 1) / 2) * (0.8 / ways) : 0);
      add(here, x[i], border, y);
      if (here !== there) add(there, border, x[i + 1], y);
    }
  });
  parts.forEach((part, k) => {
    if (part.x.length) traces.push({
      ...part, yaxis: "y9", mode: "lines", hoverinfo: "skip", name: `contacts ${STATES[k][0]}`,
      connectgaps: false,
      line: { color: css(STATES[k][1]), width: Math.max(1.5, Math.min(14, 0.75 * tall / ways)) },
    });
  });
  const every = Math.ceil(rows.length / Math.max(2, Math.floor(520 * share / 15)));
  const ticks = rows.map((_, row) => row).filter((row) => row % every === 0);
  layout.yaxis9 = {
    domain: [0, share], range: [rows.length - 0.5, -0.5], tickvals: ticks,
    ticktext: ticks.map((row) => escaped(data.contacts[rows[row]])),
    title: { text: "contact", standoff: 8 }, showgrid: false, fixedrange: true,
  };
}
