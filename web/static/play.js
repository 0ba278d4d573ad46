// Moves the pieces of a question's boards, all on one clock. It draws nothing: the server drew the boards.
import { t } from "./sentences.js";

const LEAD = 650, USUAL = 520, TAIL = 1300, CELL = 20; // ms before the clip, of a step, after it; units of a cell
const WAY = { up: [0, -1], down: [0, 1], left: [-1, 0], right: [1, 0] };
const calm = matchMedia("(prefers-reduced-motion: reduce)");

const at = ([x, y]) => `translate(${x}px, ${y}px)`;
const points = (piece) => piece.dataset.path.split(" ").map((point) => point.split(",").map(Number));

// The keyframes of a piece: it rests at every centre; a blocked step goes a little way and comes back.
function journey(piece, bumps, total, step) {
  const way = points(piece), frames = [{ offset: 0, transform: at(way[0]) }];
  for (let k = 0; k + 1 < way.length; k++) {
    const start = (LEAD + k * step) / total;
    frames.push({ offset: start, transform: at(way[k]), easing: "ease-in-out" });
    const [dx, dy] = WAY[bumps[k]] ?? [0, 0];
    if (dx || dy) frames.push({ offset: start + (0.4 * step) / total, transform: at([way[k][0] + dx * CELL * 0.28, way[k][1] + dy * CELL * 0.28]), easing: "ease-out" });
    frames.push({ offset: start + (0.85 * step) / total, transform: at(way[k + 1]) });
  }
  return [...frames, { offset: 1, transform: at(way.at(-1)) }];
}

// Opacity that is 1 from one moment to another and 0 outside. An `overview` is also there before the first step.
function visible(from, to, total, overview = 0) {
  const marks = [[0, +(from <= 0 || !!overview)]];
  if (from > 0 && overview) marks.push([overview, 1], [overview, 0]);
  if (from > 0) marks.push([from, marks.at(-1)[1]], [from, 1]);
  if (to < total) marks.push([to, 1], [to, 0]);
  return [...marks, [total, +(to >= total)]].map(([moment, opacity]) => ({ offset: moment / total, opacity }));
}

// A frame is there from the middle of its step to the middle of the next; a cue comes when the agent has arrived, and
// stays, if it has no end. A board that stands still shows at first the cues of the whole clip.
function animate(board, total, step) {
  const bumps = board.dataset.bumps.split(" "), steps = board.dataset.actions.split(" ").length;
  const timing = { duration: total, iterations: Infinity };
  const parts = [...board.querySelectorAll("[data-path]")].map((piece) =>
    piece.animate(journey(piece, piece.matches(".agent") ? bumps : [], total, step), timing));
  for (const part of board.querySelectorAll("[data-from]")) {
    const from = Number(part.dataset.from), to = Number(part.dataset.to ?? steps);
    const late = part.matches(".cue") ? 0.7 : 0.5, overview = calm.matches && !part.matches(".frame, [opacity]") ? LEAD : 0;
    const moment = (k) => LEAD + (k - 1 + late) * step;
    parts.push(part.animate(visible(from && moment(from), to < steps ? moment(to + 1) : total, total, overview), timing));
  }
  const drowned = board.querySelector(".cue.drown");
  if (drowned) parts.push(board.querySelector(".body").animate(visible(0, LEAD + (steps - 0.3) * step + 150, total), timing));
  return parts;
}

// Start both boards; returns what the page's keys and buttons do with them.
// Before the first step and after the last the clock stands still. A page that moves is painted sixty times a second, and
// what comes next has to queue for its frame; a page that stands still paints the next question at once.
// `round` is called where a round of the clips begins again; `step` is the time of a step.
export function play(question, round = null, step = USUAL) {
  const boards = [...question.querySelectorAll(".board")];
  const steps = Math.max(...boards.map((board) => board.dataset.actions.split(" ").length));
  const end = LEAD + steps * step, total = end + TAIL;
  const parts = boards.flatMap((board) => animate(board, total, step));
  const bar = question.querySelector(".steps"), shown = bar?.querySelector("output");
  let held = null; // the step at which both boards are held
  let timer = 0;
  const count = () => held ?? Math.min(steps, Math.max(0, Math.round((parts[0].currentTime % total - LEAD) / step)));
  const tell = () => {
    if (!bar) return;
    const words = t("Step {step} of {steps}", { step: count(), steps });
    if (shown.value !== words) shown.value = words;
  };
  // Whoever has taken the clock meanwhile keeps it: `state` says how it was left.
  const later = (ms, state, then) => {
    clearTimeout(timer);
    timer = setTimeout(() => { if (question.isConnected && parts[0].playState === state) then(); }, ms);
  };
  const still = () => {
    clearTimeout(timer);
    for (const part of parts) part.pause();
  };
  const run = (from) => {
    const now = document.timeline.currentTime;
    held = null;
    for (const part of parts) { part.play(); part.startTime = now - from; }
    later(end - from, "running", () => { still(); later(TAIL, "paused", () => { begin(); round?.(); }); });
  };
  const begin = () => {
    for (const part of parts) part.currentTime = 0;
    later(LEAD, "paused", () => { if (parts[0].currentTime === 0) run(LEAD); });
  };
  const go = (by) => {
    const place = held = Math.min(steps, Math.max(0, count() + by));
    still();
    // A time that is set before the pause has come about is not painted by Chromium.
    Promise.all(parts.map((part) => part.ready)).then(() => {
      if (held !== place) return;
      for (const part of parts) part.currentTime = place ? LEAD + place * step : 0;
      tell();
    });
  };
  let replays = 0; // what somebody asked for; the rounds that the clock begins do not count
  const replay = () => { replays++; run(0); };
  const controls = { replay, go, still, step: count, get replays() { return replays; } };
  still();
  if (!bar) return controls;
  bar.hidden = false;
  for (const button of bar.querySelectorAll("[data-step]")) button.addEventListener("click", () => go(Number(button.dataset.step)));
  for (const part of bar.querySelectorAll("[data-step], output")) part.hidden = steps < 2 && !calm.matches;
  if (!shown.hidden) {
    const timer = setInterval(() => { if (question.isConnected) tell(); else clearInterval(timer); }, step / 4);
  }
  bar.querySelector("[data-replay]").addEventListener("click", replay);
  if (calm.matches) go(0); else begin();
  return controls;
}
