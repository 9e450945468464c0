// Menus and keys.
const find = (id) => document.getElementById(id);
const state = { at: [], place: 0, scale: "decibel", x: "linear", others: false, mark: -1,
  contact: -1, band: 0, cursor: -1 };

function menu(form, id, label, entries, value, chosen) {
  const owner = document.createElement("label"), list = document.createElement("select");
  owner.textContent = label;
  list.id = id;
  entries.forEach(([key, words]) => list.append(new Option(words, key)));
  list.value = String(value);
  list.addEventListener("change", () => chosen(list.value));
  owner.append(list);
  find(form).append(owner);
  return list;
}

// The number of the chosen curve among those of the page.
function curveNumber() {
  return data.dims.reduce((number, dim, d) => number * dim.labels.length + state.at[d], 0);
}
const curve = () => data.curves[curveNumber()];

function indexOf(number) {
  const at = [];
  for (let d = data.dims.length - 1; d >= 0; d--) {
    const size = data.dims[d].labels.length;
    at[d] = number % size;
    number = Math.floor(number / size);
  }
  return at;
}

function draw(id, figure, then) {
  Plotly.react(find(id), figure.traces, figure.layout, CONFIG).then(then || (() => {}));
}

const SCALES = { decibel: "decibels", log: "logarithmic", linear: "linear" };

function buildMenus() {
  const { panels, x } = data.layout;
  data.dims.forEach((dim, d) => {
    state.at[d] = 0;
    const label = withUnit(dim.name, dim.units && dim.units !== "1" ? `[${dim.units}]` : "");
    menu("menus", `dim-${d}`, label, dim.labels.map((words, k) => [k, words]), 0, (value) => {
      state.at[d] = Number(value);
      state.mark = state.contact = -1;
      show();
    });
  });
  if (panels[0].places && data.dofs.length)
    menu("menus", "place", "place",
      [[0, "largest response"], ...data.dofs.map((k) => [k + 1, data.places[k] || `place ${k}`])],
      0,
      (value) => { state.place = Number(value); show(); });
  state.scale = panels[0].scales[0];
  menu("menus", "scale", panels[0].places ? "amplitude" : panels[0].title,
    panels[0].scales.map((name) => [name, SCALES[name]]), state.scale,
    (value) => { state.scale = value; show(); showEnsemble(); });
  state.x = x.wide ? "log" : "linear";
  menu("menus", "x-scale", x.title, [["linear", "linear"], ["log", "logarithmic"]], state.x,
    (value) => { state.x = value; show(); showEnsemble(); });
  if (data.curves.length > 1) {
    const owner = document.createElement("label"), box = document.createElement("input");
    owner.className = "check";
    box.type = "checkbox";
    box.id = "others";
    box.checked = state.others = true;
    box.addEventListener("change", () => { state.others = box.checked; show(); });
    owner.append(box, data.curves.length > MOST_OTHERS + 1 ? `first ${MOST_OTHERS} other sets`
      : "other sets");
    find("menus").append(owner);
  }
}

function show(later) {
  const one = curve();
  state.cursor = -1;
  if (data.layout) {
    const points = one.columns ? `${one.n[0]} of ${one.n[1]} points` : "nothing to draw";
    find("status").textContent = [one.label, points, one.status].filter(Boolean).join("; ");
    const failed = Boolean(one.status) && !data.complete.includes(one.status);
    find("status").classList.toggle("warn", failed);
    draw("chart", curveFigure(one, state));
    find("readout").textContent = "";
  }
  // The page opens with the curve; what lies below it is drawn next.
  if (later) setTimeout(later);
  else showMotion();
  document.querySelectorAll("button.go").forEach((button) => {
    const current = Number(button.dataset.curve) === curveNumber()
      && Number(button.dataset.mark) === state.mark;
    button.closest("tr").classList.toggle("current", current);
    button.setAttribute("aria-pressed", String(current));
  });
}

// The contact whose loop encloses the most, -1 where there is none.
function busiest(motion, contacts) {
  const area = (contact) => {
    const u = array(motion.loops[contact].u[0]), f = array(motion.loops[contact].f[0]);
    const piece = (i) => (f[i] + f[i - 1]) * (u[i] - u[i - 1]);
    return Math.abs(u.reduce((sum, _, i) => (i ? sum + piece(i) : 0), 0));
  };
  return contacts.reduce((best, c) => (best < 0 || area(c) > area(best) ? c : best), -1);
}

// The motion at the chosen mark, or at the highest peak that has one.
function showMotion() {
  const one = curve(), held = one.marks.map((mark, k) => [k, mark])
    .filter(([, mark]) => mark.motion);
  find("motion").hidden = !one.marks.length;
  find("motion-menus").replaceChildren();
  if (!one.marks.length) return;
  if (state.mark < 0 || state.mark >= one.marks.length) {
    const best = held.filter(([, mark]) => mark.what === "peak")
      .sort((a, b) => (b[1].y || 0) - (a[1].y || 0))[0] || held[0];
    state.shown = best ? best[0] : 0;
  } else state.shown = state.mark;
  const mark = one.marks[state.shown], units = data.layout ? data.layout.x.units : "Hz";
  menu("motion-menus", "mark", "peak or event",
    one.marks.map((m, k) => [k,
    `${markName(m)} at ${withUnit(number(m.x), units)}${m.motion ? "" : " (not stored)"}`]),
    state.shown, (value) => { state.mark = Number(value); show(); find("mark").focus(); });
  const contacts = mark.motion ? Object.keys(mark.motion.loops).map(Number) : [];
  if (!contacts.includes(state.contact))
    state.contact = contacts.includes(mark.contact) ? mark.contact : busiest(mark.motion, contacts);
  if (contacts.length > 1) menu("motion-menus", "contact", "contact",
    contacts.map((c) => [c, `contact ${data.contacts[c] ?? c}`]), state.contact,
    (value) => { state.contact = Number(value); showMotion(); find("contact").focus(); });
  const words = mark.point >= 0 ? markLines(one, mark, state.place)
    : [markName(mark), `at ${withUnit(number(mark.x), units)}`,
    mark.y ? `amplitude ${number(mark.y)} m` : ""];
  find("motion-text").textContent = words.filter(Boolean).join("; ")
    + (mark.motion ? "" : ". The page holds no motion here, and tells below what it leaves out.");
  find("loop").hidden = state.contact < 0;
  const shaped = mark.motion && data.places.length > 1;
  find("shape").hidden = !shaped;
  if (mark.motion && state.contact >= 0) draw("loop", loopFigure(mark.motion, state.contact));
  if (shaped) draw("shape", shapeFigure(mark.motion));
}

function showEnsemble() {
  const all = data.ensemble;
  find("ensemble").hidden = !all;
  if (!all) return;
  const band = all.bands[state.band], spread = all.spread[state.band], told = [];
  if (band) told.push(all.how);
  if (spread) told.push(`Largest responses are known of ${spread.n[0]} of ${spread.n[1]} samples.`);
  find("ensemble-text").textContent = told.join(" ");
  find("band").hidden = !band || !band.items.length;
  if (band && band.items.length) draw("band", panelFigure(band, state.scale, state.x === "log"));
  find("spread").hidden = !spread || !spread.n[0];
  if (spread && spread.n[0]) draw("spread", panelFigure(spread));
}

function choose(number, mark) {
  state.at = indexOf(number);
  state.mark = mark;
  state.contact = -1;
  data.dims.forEach((_, d) => { find(`dim-${d}`).value = String(state.at[d]); });
  show();
}

// The keys of the curve: from point to point, and the motion at a mark.
function keys(event) {
  const one = curve(), n = one.columns ? array(one.x).length : 0,
    marks = one.marks.map((mark) => mark.point);
  if (event.key === "Enter" && state.cursor >= 0 && marks.includes(state.cursor)) {
    state.mark = marks.indexOf(state.cursor);
    return show();
  }
  const last = Math.max(0, n - 1);
  const next = { ArrowRight: state.cursor + 1, ArrowLeft: state.cursor - 1, Home: 0,
    End: last }[event.key];
  if (next === undefined || !n) return;
  event.preventDefault();
  state.cursor = Math.max(0, Math.min(last, next));
  const k = marks.indexOf(state.cursor);
  find("readout").textContent = (k >= 0 ? markLines(one, one.marks[k], state.place)
    : pointLines(one, state.cursor, state.place)).join("; ");
  const traces = find("chart").data,
    mark = traces.findIndex((each) => each.meta === "marks" && each.customdata.includes(k));
  const trace = mark >= 0 ? mark : traces.findIndex((each) => each.meta === "points");
  const pointNumber = mark >= 0 ? traces[mark].customdata.indexOf(k) : state.cursor;
  if (trace >= 0) Plotly.Fx.hover(find("chart"), [{ curveNumber: trace, pointNumber }]);
}

function showBelow() {
  if (data.curves.length) showMotion();
  showEnsemble();
  document.documentElement.dataset.ready = "yes";
}

function start() {
  if (data.curves.length) {
    if (data.layout) {
      find("curves").hidden = false;
      buildMenus();
    } else find("motion").querySelector("h2").textContent = "Motion";
    show(showBelow);
    find("chart").addEventListener("keydown", keys);
    if (data.layout) find("chart").on("plotly_click", ({ points }) => {
      const [point] = points;
      if (point.data.meta === "marks") { state.mark = point.customdata; show(); }
    });
  }
  const several = data.ensemble
    && (data.ensemble.bands.length ? data.ensemble.bands : data.ensemble.spread);
  if (several && several.length > 1)
    menu("ensemble-menus", "band-of", "samples of", several.map((band, k) => [k, band.label]), 0,
      (value) => { state.band = Number(value); showEnsemble(); });
  if (!data.curves.length) showBelow();
  document.querySelectorAll("button.go")
    .forEach((button) => button.addEventListener("click", () => {
    choose(Number(button.dataset.curve), Number(button.dataset.mark));
    find("motion").scrollIntoView({ block: "nearest" });
  }));
  document.querySelectorAll("form")
    .forEach((form) => form.addEventListener("submit", (event) => event.preventDefault()));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change",
    () => { if (data.curves.length) show(); showEnsemble(); });
}
start();
