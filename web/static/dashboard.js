// The dashboard: numbers, the table of stages and small charts by Plotly, fed by the run's metrics as they come.
import { seen } from "./board_panel.js";
import "./errors.js";
import { curvesOf } from "./curves.js";
import { follow } from "./live.js";
import { number } from "./numbers.js";

const main = document.getElementById("main"), run = main.dataset.run;
const lineOf = (id) => document.querySelector(`[data-chart=${id}]`)?.dataset.line;
const SERIES = {
  deaths: [["deaths", "deaths"]],
  asked: [["guidance", "guidance"], ["preference", "preference"], ["skips", "guidance skipped"]],
  answers: [["left", "left"], ["right", "right"], ["either", "either"], ["neither", "neither"]],
  return: [["return", "argmax policy"], ["optimal_return", lineOf("return")]],
  stages: [["return", "argmax policy"], ["optimal_return", lineOf("stages")]],
  loss: [["loss", "loss"]],
  entropy: [["entropy_global", "global head"], ["entropy_local", "local head"]],
  size: [["rows", "distinct rows"], ["size", "entries"]],
};
const CALM = 1000; // ms between two drawings: eight charts cost much, and the parent's page may share the machine
const COUNTS = new Set(["deaths", "asked", "answers", "size"]);
const LONG = 60_000; // ms after which what was missed is not told row by row
const namesOf = (id) => SERIES[id].map(([key]) => key);
const curves = curvesOf(run, [...new Set(Object.keys(SERIES).flatMap(namesOf))]);
let stages = [];
let queued = false, drawn = -CALM, told = -LONG, version = 0;

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const largest = (id) => Math.max(...namesOf(id).map((key) => curves.latest(key) ?? 0));

// ---- stages

// The rows of the table, as the server computes them (server/pages/stages.py).
async function loadStages() {
  const reply = await fetch(`/runs/${run}/stages`).catch(() => null);
  if (reply?.ok) stages = await reply.json();
  for (const { number: stage, when, begin, end, value, reference, unsafe, guidance, preference } of stages) {
    const row = document.querySelector(`tr[data-stage="${stage}"]`);
    const cells = [value, reference, unsafe, guidance, preference, begin === null ? null : `${number(begin)} to ${number(end)}`];
    row.className = when;
    row.querySelectorAll("td").forEach((cell, at) => { cell.textContent = number(cells[at]); });
  }
}

const begun = () => stages.filter(({ begin }) => begin !== null);

// ---- charts

// A line where each stage but the first begins.
function borders() {
  const at = begun().slice(1).map(({ begin, number }) => [begin, number]);
  const line = { color: colour("quiet"), width: 1, dash: "dot" };
  return {
    shapes: at.map(([x]) => ({ type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line })),
    annotations: at.map(([x, T]) => ({ x, y: 1, yref: "paper", text: `T = ${T}`, showarrow: false, xanchor: "left", yanchor: "top", xshift: 3, font: { size: 11, color: colour("quiet") } })),
  };
}

function layout(id) {
  const axis = { color: colour("quiet"), gridcolor: colour("line"), zeroline: false, fixedrange: false, automargin: true };
  const many = SERIES[id].length > 1, by = id === "stages";
  return {
    margin: { l: 8, r: 8, t: many ? 26 : 8, b: 8 }, height: 240, autosize: true, hovermode: "x unified", showlegend: many, uirevision: id, datarevision: version, // our arrays grow in place
    paper_bgcolor: "transparent", plot_bgcolor: "transparent", font: { family: "system-ui, DejaVu Sans, sans-serif", size: 12, color: colour("quiet") },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { color: colour("ink") } },
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("ink") } },
    xaxis: { ...axis, title: { text: by ? "T" : "tick", standoff: 4 }, showgrid: false, ...(by && { dtick: 1, range: [0.5, begun().length + 0.5] }) },
    yaxis: { ...axis, dtick: COUNTS.has(id) && largest(id) < 6 ? 1 : null, rangemode: COUNTS.has(id) || by ? "tozero" : "normal", type: logs.has(id) ? "log" : "linear" },
    ...(!by && borders()),
  };
}

function traces(id) {
  if (id === "stages") return bars();
  const colours = [colour("blue"), colour("agent"), colour("leaf"), colour("unreal")];
  return SERIES[id].map(([key, name], at) => ({
    type: "scatter", mode: "lines", ...curves.curve(id, key), name,
    line: { color: key === "optimal_return" ? colour("quiet") : colours[at], width: 2, shape: COUNTS.has(id) ? "hv" : "linear", dash: key === "optimal_return" ? "dash" : "solid" },
  }));
}

// A bar for each stage, and the line that it is held against.
function bars() {
  const all = begun(), x = all.map(({ number }) => number);
  const [[, policy], [, line]] = SERIES.stages;
  return [
    { type: "bar", x, y: all.map(({ value }) => value), name: policy, width: 0.5, marker: { color: colour("blue") } },
    { type: "scatter", mode: "lines", x: [0.5, ...x, x.length + 0.5], y: Array(x.length + 2).fill(curves.latest("optimal_return")), name: line, line: { color: colour("quiet"), width: 2, dash: "dash" } },
  ];
}

const logs = new Set();
const figures = [...document.querySelectorAll("[data-chart]")];

// Plotly has megabytes: the board does not wait for it.
const library = new Promise((come, fail) => {
  const script = document.getElementById("plotly");
  if (window.Plotly) come();
  script.addEventListener("load", come);
  script.addEventListener("error", () => fail(new Error("The charts did not load. Load the page again.")));
});

async function draw() {
  queued = false;
  drawn = performance.now();
  await Promise.all([loadStages(), library]);
  for (const figure of figures) {
    const id = figure.dataset.chart, plot = figure.querySelector(".plot");
    await window.Plotly.react(plot, traces(id), layout(id), { displayModeBar: false, responsive: true });
    if (figure.dataset.zooms || id === "stages") continue;
    figure.dataset.zooms = "yes";
    plot.on("plotly_relayout", (change) => zoomed(id, change));
  }
}

// A part that is looked at closely is drawn with points of its own.
async function zoomed(id, change) {
  const { "xaxis.range[0]": begin, "xaxis.range[1]": end, "xaxis.autorange": reset } = change;
  if (begin === undefined && !reset) return;
  await curves.zoom(id, namesOf(id), begin, end);
  redraw();
}

function redraw() {
  if (queued || curves.after() < 0) return;
  queued = true;
  version++;
  document.getElementById("charts").hidden = false;
  setTimeout(() => requestAnimationFrame(draw), Math.max(0, drawn + CALM - performance.now()));
}

// ---- what comes in

const put = (name, value) => {
  const element = document.getElementById(`now-${name}`);
  if (element) element.textContent = number(value, 3);
};

function add(rows) {
  told = performance.now();
  if (curves.add(rows)) load();
  const newest = rows.at(-1)?.values;
  if (newest) for (const name of ["deaths", "return", "optimal_return", "stage_queries"]) put(name, newest[name]);
  redraw();
}

async function load() {
  await curves.load(() => status("offline"));
  redraw();
}

const status = (which) => {
  main.dataset.state = which;
  for (const part of document.querySelectorAll(".status [data-state]")) part.hidden = part.dataset.state !== which;
};

// What the operator did has its tick once it applied: the list is fetched again.
async function applied(tick) {
  const list = document.getElementById("events");
  if (!list?.querySelector("[data-pending]") || Number(list.dataset.tick) === tick) return;
  list.dataset.tick = tick;
  const page = await fetch(location.pathname).then((reply) => reply.text()).catch(() => "");
  const fresh = new DOMParser().parseFromString(page, "text/html").getElementById("events");
  if (fresh) list.replaceChildren(...fresh.childNodes);
}

const tell = {
  ready: async () => {
    if (performance.now() - told < LONG) return;
    await load();
    told = performance.now();
  },
  after: curves.after,
  metrics: add,
  run(now) {
    status(now.state);
    main.dataset.status = now.status;
    put("tick", now.tick);
    put("answered", now.standing);
    put("skipped", now.skipped);
    put("goal", now.goal);
    document.getElementById("goal-many").hidden = now.goal === 1;
    put("maturity", now.maturity);
    if (now.reason) put("reason", now.reason);
    put("speed", now.speed);
    put("optimal", now.optimal ? "optimal" : "learning");
    for (const button of document.querySelectorAll("[data-more]")) button.value = now.goal + Number(button.dataset.more);
    applied(now.tick);
    seen();
  },
  lost: (code) => status(code === 401 || code === 403 ? "refused" : "offline"),
};

for (const figure of figures) {
  const id = figure.dataset.chart;
  figure.querySelector("[data-log]")?.addEventListener("click", ({ target }) => {
    logs.delete(id) || logs.add(id);
    target.setAttribute("aria-pressed", logs.has(id));
    redraw();
  });
  figure.querySelector("[data-save]").addEventListener("click", () =>
    window.Plotly.downloadImage(figure.querySelector(".plot"), { format: "png", scale: 2, filename: `run-${run}-${id}` }));
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
document.querySelector(".data").open = false;
follow(run, tell);
