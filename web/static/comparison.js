// Runs compared: a chart for each metric, in which every run is a curve of its group's colour and dash.
import "./errors.js";
import { following } from "./comparison_live.js";
import { curvesOf } from "./curves.js";

const CALM = 1500; // ms between two drawings while curves arrive
const COLOURS = ["blue", "agent", "leaf", "unreal", "dry"];
const DASHES = ["solid", "dash", "dot", "dashdot"];
const STEPS = new Set(["deaths", "guidance", "preference", "rows"]);
const { by, points } = document.getElementById("main").dataset;
const figures = [...document.querySelectorAll("[data-chart]")];
const metrics = figures.map((figure) => figure.dataset.chart);
const heads = [...document.querySelectorAll("tr[data-group]:not([data-run])")].map((row) => row.dataset);
const groups = heads.map(({ group }) => group), LONGEST = 24; // letters of a label in a legend
// Plotly reads a legend as markup, and a label is what somebody has typed.
const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
const short = (letters) => letters.slice(0, LONGEST).join("") + (letters.length > LONGEST ? "…" : "");
const names = heads.map(({ group, label }) => plain(label ? `${group}: ${short([...label])}` : group));
const runs = [...document.querySelectorAll("tr[data-run]")].map(({ dataset: { run, group } }) => ({ run, group, place: groups.indexOf(group), curves: curvesOf(run, metrics, { by, points }), loaded: false }));
let timer = 0, version = 0;

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

function traces(metric) {
  const named = new Set();
  return runs.filter(({ loaded }) => loaded).map(({ run, group, place, curves }) => {
    const first = !named.has(group);
    named.add(group);
    return {
      type: "scatter", mode: "lines", ...curves.curve(metric, metric), name: names[place], legendgroup: group, showlegend: first,
      hovertemplate: `run ${run} (${group})<br>${by} %{x:.6~g}: %{y:.6~g}<extra></extra>`,
      line: { width: runs.length > 20 ? 1 : 2, shape: STEPS.has(metric) ? "hv" : "linear", color: colour(COLOURS[place % COLOURS.length]), dash: DASHES[place % DASHES.length] },
    };
  });
}

function layout(metric) {
  const axis = { color: colour("quiet"), gridcolor: colour("line"), zeroline: false, automargin: true }, many = groups.length > 1;
  return {
    margin: { l: 8, r: 8, t: many ? 26 : 8, b: 8 }, height: 240, autosize: true, hovermode: "closest", showlegend: many, uirevision: metric, datarevision: version,
    paper_bgcolor: colour("card"), plot_bgcolor: "transparent", font: { family: "system-ui, DejaVu Sans, sans-serif", size: 12, color: colour("quiet") },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { color: colour("ink") } },
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("ink") } },
    xaxis: { ...axis, title: { text: by, standoff: 4 }, showgrid: false },
    yaxis: { ...axis, rangemode: STEPS.has(metric) ? "tozero" : "normal" },
  };
}

async function draw() {
  timer = 0;
  version++;
  document.getElementById("charts").hidden = false;
  for (const figure of figures) {
    const metric = figure.dataset.chart, plot = figure.querySelector(".plot");
    await window.Plotly.react(plot, traces(metric), layout(metric), { displayModeBar: false, responsive: true });
    if (figure.dataset.zooms) continue;
    figure.dataset.zooms = "yes";
    plot.on("plotly_relayout", (change) => zoomed(metric, change));
  }
}

function redraw(wait = 0) {
  if (timer && wait) return;
  clearTimeout(timer);
  timer = setTimeout(draw, wait);
}

// A part that is looked at closely is drawn with points of its own.
async function zoomed(metric, { "xaxis.range[0]": begin, "xaxis.range[1]": end, "xaxis.autorange": reset }) {
  if (begin === undefined && !reset) return;
  await Promise.all(runs.map(({ curves }) => curves.zoom(metric, [metric], begin, end)));
  redraw();
}

for (const figure of figures) {
  for (const button of figure.querySelectorAll("[data-save]")) {
    button.addEventListener("click", () =>
      window.Plotly.downloadImage(figure.querySelector(".plot"), { format: button.dataset.save, scale: 2, filename: `compare-${figure.dataset.chart}-by-${by}` }));
  }
}
const load = async (one) => {
  await one.curves.load(() => {});
  one.loaded = true;
  redraw(runs.every(({ loaded }) => loaded) ? 0 : CALM);
};
for (const one of runs) load(one);
following((numbers) => Promise.all(runs.filter(({ run }) => numbers.includes(run)).map(load)));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw());
