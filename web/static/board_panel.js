// The board of the dashboard: what the agent would do in every cell and what is known of it, at any stored tick of its life.
// All of it was stored by the worker; nothing of a policy is computed here.
import { cells } from "./board_cell.js";
import { boardOf } from "./board_data.js";
import { paintArrows, paintShares } from "./board_paint.js";
import { pickers } from "./board_rests.js";
import { number } from "./numbers.js";
import { job } from "./worker_job.js";

const $ = (id) => document.getElementById(id);
const panel = $("seen"), slider = $("seen-slider"), form = panel.querySelector(".seen-choices");
const { run } = document.getElementById("main").dataset;
const data = boardOf(run), { known } = data;
const WAYS = ["up", "down", "left", "right"], COUNTS = ["visits", "deaths", "entries"];
const NAMES = Object.fromEntries([...panel.querySelectorAll("[data-number]")].map(({ dataset, previousElementSibling }) => [dataset.number, previousElementSibling.textContent]));
const CALM = 1000, LATER = 3000; // ms between two looks for new snapshots, and until the last one after an event
const LONGEST = 30_000; // ms at most until a partial snapshot is read again
let shown = null, sums = null, index = new Map(); // the snapshot, its counts by cell, the states of this rest by cell
let newest = true, wanted = null, busy = false, looked = -CALM, timer = 0, looking = false, again = false, late = false, rereading = 0, pause = LATER;

const percent = (share) => share > 0 && share < 0.005 ? "under 1\u00a0%" : `${Math.round(100 * share)}\u00a0%`;
const listed = (numbers) => Object.entries(numbers).map(([name, text]) => `${NAMES[name]} ${text}`).join(", ");
const computed = new Map(); // what a worker has computed of states that are not stored
const computedKey = (row, column) => `${row} ${column} ${pick.rest} ${form.elements.stage.value}`;
const put = (id, words) => { if ($(id).textContent !== words) $(id).textContent = words; };
const key = (row, column) => `${row} ${column}`;

// ---- what is known of a cell

function valueOf(name, place, state) {
  if (COUNTS.includes(name)) return sums[name].get(place) ?? 0;
  return state === undefined ? null : shown[name]?.[state] ?? null;
}

const countsOf = (place) => Object.fromEntries(COUNTS.filter((name) => sums?.[name].has(place)).map((name) => [name, number(sums[name].get(place))]));

function tell([row, column]) {
  const place = key(row, column), state = index.get(place), tile = pick.tile(row, column), numbers = {};
  const where = `Row ${row + 1}, column ${column + 1}: ${tile}.`, policy = shown && state !== undefined ? shown.policy(state) : null;
  if (!policy) {
    const told = newest ? computed.get(computedKey(row, column)) : null;
    const never = known.complete || pick.wall(row, column), said = told?.said ?? (never ? "In this state the agent never decides here." : "Of this state nothing is stored.");
    const all = { ...told?.numbers, ...countsOf(place) };
    return { tile: tile && `${tile}. ${said}`, numbers: all, spoken: `${where} ${said} ${listed(all)}`.trim(), open: !!shown && !never && newest && !told?.going };
  }
  WAYS.forEach((way, at) => { numbers[way] = percent(policy[at]); });
  for (const name of ["familiarity", "ask", ...COUNTS]) {
    const value = valueOf(name, place, state);
    if (value !== null) numbers[name] = name === "ask" ? percent(value) : number(value);
  }
  return { tile, numbers, spoken: `${where} ${listed(numbers)}` };
}

// A state that is not stored, as it is with the present policy: a worker computes it.
async function ask([row, column]) {
  const mine = computedKey(row, column), stage = Number(form.elements.stage.value);
  const told = (said) => { computed.set(mine, { said, numbers: {}, going: true }); showCell(); };
  told("A worker computes it.");
  try {
    const waits = (worker) => told(worker === "silent" ? "No worker is running; it is computed once one is started (parenting worker)." : "A worker computes it.");
    const { result } = await job(run, "state", { row, column, rest: pick.rest, stage }, waits, () => true);
    const numbers = Object.fromEntries(WAYS.map((way, at) => [way, percent(result.probabilities[at])]));
    computed.set(mine, { said: `Computed for tick ${number(result.tick)}.`, numbers: { ...numbers, familiarity: number(result.familiarity), ask: percent(result.ask) } });
  } catch ({ message }) { computed.set(mine, { said: message, numbers: {} }); }
  showCell(true);
}

// ---- what is painted

// Counts grow without end, so they are shaded by their logarithm.
function shade(name) {
  const values = COUNTS.includes(name) ? [...sums[name]] : [...index].map(([place, state]) => [place, valueOf(name, place, state) ?? 0]);
  const places = values.map(([place, value]) => [place.split(" ").map(Number), value]);
  const most = Math.max(0, ...places.map(([, value]) => value)), scale = COUNTS.includes(name) ? Math.log1p : (value) => value;
  paintShares($("seen-layer"), places.map(([place]) => place), places.map(([, value]) => most ? scale(value) / scale(most) : 0));
  return `Shade: ${NAMES[name]}, up to ${name === "ask" ? percent(most) : number(most)}${COUNTS.includes(name) ? ", by its logarithm" : ""}.`;
}

function paint() {
  if (!shown) return;
  const { layer, arrows } = form.elements, name = layer.value;
  const states = arrows.checked ? [...index.values()].filter((state) => state < shown.states) : [];
  paintArrows($("seen-arrows"), states.map((state) => known.cells[state]), states.map((state) => shown.policy(state)));
  panel.dataset.layer = name;
  $("seen-layer").replaceChildren();
  const words = name ? shade(name) : "";
  put("seen-legend", `${arrows.checked ? "Arrows: the longer and darker, the likelier." : ""} ${words}`.trim());
  showCell();
}

function sumUp() {
  sums = Object.fromEntries(COUNTS.map((name) => [name, new Map()]));
  for (const name of COUNTS) {
    shown[name]?.forEach((value, state) => {
      const [row, column] = known.cells[state], place = key(row, column);
      if (value) sums[name].set(place, (sums[name].get(place) ?? 0) + value);
    });
  }
}

function turned() {
  index = new Map();
  known.cells.forEach(([row, column, rest], state) => { if (rest === pick.rest) index.set(key(row, column), state); });
  paint();
}

// ---- which snapshot

const wordsOf = ({ tick, maturity, answers }) => `Tick ${number(tick)}, stage ${maturity}, ${number(answers)} answer${answers === 1 ? "" : "s"}`;

// The policies pi_1 to pi_T of this snapshot; the one that acts is chosen until another one is.
function offerStages(maturity) {
  const select = form.elements.stage, before = Number(select.value) || null;
  if (select.options.length === maturity) return;
  const follows = before === null || before === select.options.length;
  select.replaceChildren(...Array.from({ length: maturity }, (_, at) => new Option(`π${at + 1}${at + 1 === maturity ? ", which acts" : ""}`, at + 1)));
  select.value = follows ? maturity : Math.min(before, maturity);
}

// Show a snapshot: the last one asked for wins, and meanwhile nothing is asked twice.
async function show(place) {
  wanted = place;
  if (busy) return;
  busy = true;
  try {
    while (wanted !== null) {
      const one = known.snapshots[wanted];
      wanted = null;
      offerStages(one.maturity);
      slider.setAttribute("aria-valuetext", wordsOf(one)); // where the slider is; the heading names what is drawn
      shown = await data.at(one.tick, Number(form.elements.stage.value));
      if (shown.states > known.cells.length) await data.news();
      sumUp();
      turned();
      put("seen-at", wordsOf(one) + (newest && one === known.snapshots.at(-1) ? " · the newest" : "") + soFar(shown));
    }
  } catch ({ message }) { put("seen-at", message); } finally {
    busy = false;
    readAgain();
  }
}

// The first snapshot of a large board is stored before all of its policy is computed, and the whole one has the same tick.
const soFar = ({ partial, known: there, states }) => partial ? ` · so far the policy of ${number(there)} of ${number(states)} states` : "";

function readAgain() {
  clearTimeout(rereading);
  if (!shown?.partial) return;
  rereading = setTimeout(() => show(Number(slider.value)), pause);
  pause = Math.min(2 * pause, LONGEST);
}

function go(place) {
  const last = known.snapshots.length - 1, to = Math.max(0, Math.min(last, place));
  newest = to === last;
  $("seen-newest").setAttribute("aria-pressed", newest);
  slider.value = to;
  show(to);
}

// Ask for new snapshots, at most once in a while; the newest is shown unless the researcher has moved the slider.
// What is told while the page looks may be newer than what the server has read for it: then it looks again. A snapshot may be
// stored after what tells of its tick: the page looks once more when nothing has been told for a while.
export function seen() {
  late = true;
  if (looking) again = true;
  else wait(Math.max(0, looked + CALM - performance.now()));
}

function wait(ms) {
  clearTimeout(timer);
  timer = setTimeout(look, ms);
}

async function look() {
  looking = true;
  again = false;
  looked = performance.now();
  const had = known.snapshots.length;
  try { await data.news(); } catch { late = true; return; } finally { // a look that failed is made again
    looking = false;
    if (again) seen();
    else if (late) {
      late = false;
      wait(LATER);
    }
  }
  if (known.snapshots.length === had) return;
  if (!had) begin();
  slider.max = known.snapshots.length - 1;
  pick.offer();
  if (newest) go(known.snapshots.length - 1);
}

function begin() {
  for (const control of panel.querySelectorAll(".seen-time *, .seen-choices *")) control.disabled = false;
}

const pick = pickers(run, known, turned, () => put("seen-at", "The board did not load. Pick it again."));
const showCell = cells(tell, ask);
slider.addEventListener("input", () => go(Number(slider.value)));
for (const button of panel.querySelectorAll("[data-time]")) button.addEventListener("click", () => go(Number(slider.value) + Number(button.dataset.time)));
$("seen-newest").addEventListener("click", () => go(known.snapshots.length - 1));
form.addEventListener("change", ({ target }) => (target.name === "stage" ? go(Number(slider.value)) : paint()));
form.addEventListener("submit", (event) => event.preventDefault());
for (const button of panel.querySelectorAll("[data-job]")) {
  button.hidden = false;
  button.addEventListener("click", () => import("./episodes.js").then(({ open }) => open(button.dataset.job)));
}
seen();
