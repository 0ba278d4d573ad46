// The dashboard: seven small charts by Plotly, fed by the run's metrics as they come.
import { follow, stateOf } from "./live.js";

const main = document.getElementById("main"), run = main.dataset.run;
const lineOf = (id) => document.querySelector(`[data-chart=${id}]`).dataset.line;
const SERIES = {
  deaths: [["deaths", "deaths"]],
  asked: [["guidance", "guidance"], ["preference", "preference"]],
  answers: [["left", "left"], ["right", "right"], ["either", "either"], ["neither", "neither"]],
  return: [["return", "argmax policy"], ["optimal_return", lineOf("return")]],
  loss: [["loss", "loss"]],
  entropy: [["entropy_global", "global head"], ["entropy_local", "local head"]],
  size: [["rows", "distinct rows"], ["size", "entries"]],
};
const COUNTS = new Set(["deaths", "asked", "answers", "size"]);
const ticks = [], values = {}; // by name, one for each tick
let last = -1, queued = false;

for (const name of Object.values(SERIES).flat().map(([key]) => key)) values[name] = [];

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const largest = (id) => Math.max(...SERIES[id].map(([key]) => values[key].at(-1)));

function layout(id) {
  const axis = { color: colour("quiet"), gridcolor: colour("line"), zeroline: false, fixedrange: false, automargin: true };
  const many = SERIES[id].length > 1;
  return {
    margin: { l: 8, r: 8, t: many ? 26 : 8, b: 8 }, height: 240, autosize: true, hovermode: "x unified", showlegend: many, uirevision: id,
    paper_bgcolor: "transparent", plot_bgcolor: "transparent", font: { family: "system-ui, DejaVu Sans, sans-serif", size: 12, color: colour("quiet") },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { color: colour("ink") } },
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("ink") } },
    xaxis: { ...axis, title: { text: "tick", standoff: 4 }, showgrid: false },
    yaxis: { ...axis, dtick: COUNTS.has(id) && largest(id) < 6 ? 1 : null, rangemode: COUNTS.has(id) ? "tozero" : "normal", type: logs.has(id) ? "log" : "linear" },
  };
}

function traces(id) {
  const colours = [colour("blue"), colour("agent"), colour("leaf"), colour("unreal")];
  return SERIES[id].map(([key, name], at) => ({
    type: "scatter", mode: "lines", connectgaps: true, x: ticks, y: values[key], name,
    line: { color: key === "optimal_return" ? colour("quiet") : colours[at], width: 2, shape: COUNTS.has(id) ? "hv" : "linear", dash: key === "optimal_return" ? "dash" : "solid" },
  }));
}

const logs = new Set();
const figures = [...document.querySelectorAll("[data-chart]")];

function draw() {
  queued = false;
  for (const figure of figures) {
    const id = figure.dataset.chart, plot = figure.querySelector(".plot");
    window.Plotly.react(plot, traces(id), layout(id), { displayModeBar: false, responsive: true });
  }
}

function redraw() {
  if (queued || !ticks.length) return;
  queued = true;
  document.getElementById("charts").hidden = false;
  requestAnimationFrame(draw);
}

const put = (name, value) => {
  const element = document.getElementById(`now-${name}`);
  if (element) element.textContent = typeof value === "number" ? Number(value.toPrecision(4)) : value ?? "–";
};

function add(rows) {
  for (const row of rows) {
    if (row.tick <= last) continue;
    ticks.push(row.tick);
    last = row.tick;
    for (const name in values) values[name].push(row.values[name] ?? null);
  }
  const newest = rows.at(-1)?.values;
  if (newest) for (const name of ["deaths", "return", "optimal_return"]) put(name, newest[name]);
  redraw();
}

const status = (which) => {
  main.dataset.state = which;
  for (const part of document.querySelectorAll(".status [data-state]")) part.hidden = part.dataset.state !== which;
};

const tell = {
  after: () => last,
  metrics: add,
  run(now) {
    status(now.status === "paused" ? "paused" : stateOf(now));
    put("tick", now.tick);
    put("answered", now.answers);
    put("optimal", now.optimal ? "optimal" : "learning");
  },
  lost: () => status("offline"),
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
