// One gentle sentence on an answer that is hasty, prefers a danger, or contradicts an earlier one: at most once in ten
// questions, and never where the run's settings want none.
import { $, main, run } from "./page.js";

const EVERY = 10, HASTE = 300, KEPT = 500; // questions between remarks, ms, pairs that are remembered
const KEY = `parenting.pairs.${run}`;
let since = EVERY, fast = 0, memory = {};

function read() {
  try { return JSON.parse(localStorage.getItem(KEY)) ?? memory; } catch { return memory; }
}

function write(pairs) {
  memory = Object.fromEntries(Object.entries(pairs).slice(-KEPT));
  try { localStorage.setItem(KEY, JSON.stringify(memory)); } catch { /* memory holds them while the page lives */ }
}

// Whether these two clips were answered the other way before. Remembers this answer.
function contradicts({ left, right }, choice) {
  const pairs = read(), pair = [left, right].sort().join(" "), chosen = { left, right }[choice], before = pairs[pair];
  delete pairs[pair];
  if (chosen) pairs[pair] = chosen;
  write(pairs);
  return Boolean(chosen && before && before !== chosen);
}

// What is to be said of an answer that was given `ms` after its question was shown; null if nothing.
function fault(question, choice, ms) {
  const dangerous = (side) => Boolean(question.querySelector(`[value=${side}] .bad`));
  const contrary = contradicts(question.dataset, choice), other = { left: "right", right: "left" }[choice];
  fast = ms < HASTE ? fast + 1 : 0;
  if (other && dangerous(choice) && !dangerous(other)) return "danger";
  if (contrary && !("again" in question.dataset)) return "contrary"; // asked again: the other answer is welcome
  return fast > 1 ? "hasty" : null;
}

export function remark(question, choice, ms) {
  if (!("remarks" in main.dataset)) return;
  const found = fault(question, choice, ms), told = found && since >= EVERY;
  since = told ? 1 : since + 1;
  $("remark").hidden = !told;
  if (!told) return;
  for (const words of $("remark").querySelectorAll("[data-slip]")) words.hidden = words.dataset.slip !== found;
  $("remark").lastElementChild.href = `/runs/${run}/parent?query=${question.dataset.query}&change=true`;
}
