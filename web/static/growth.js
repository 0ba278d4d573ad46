// How far the agent has come: milestones are told once in a browser, and the waiting screen shows the growth line and what
// the last answer changed. Nothing here is loaded before the first answer.
import { t } from "./sentences.js";

const EVERY = 3000, SHOWN = 7000; // ms between two looks at the line, and for which a milestone stays on the screen
const main = document.getElementById("main"), waiting = document.getElementById("waiting");
const { run } = main.dataset, KEY = `parenting.told.${run}`;
const line = Object.assign(document.createElement("p"), { className: "news" });
const part = document.createElement("div"), said = Object.assign(document.createElement("p"), { className: "sr" });
const WAYS = [t("up"), t("down"), t("left"), t("right")], LEAST = 0.01; // a probability that changed by less is not told
const note = Object.assign(document.createElement("p"), { className: "lesson" });
let seen = "", looked = 0, timer = 0;

line.setAttribute("role", "status");
said.setAttribute("role", "status");
main.append(line);
waiting.append(part, said);
document.querySelector(".beside").append(note);

const told = new Set((() => { try { return JSON.parse(localStorage.getItem(KEY)) ?? []; } catch { return []; } })());

// Milestones that this browser has not told yet, in the server's words.
async function tell(now) {
  const fresh = Object.keys(now.milestones ?? {}).filter((name) => !told.has(name));
  if (!fresh.length) return;
  for (const name of fresh) told.add(name);
  const found = await shown();
  if (!found) return fresh.forEach((name) => told.delete(name)); // the next event tells them
  try { localStorage.setItem(KEY, JSON.stringify([...told])); } catch { /* then they are told again on the next page */ }
  line.textContent = fresh.map((name) => found.querySelector(`[data-milestone="${name}"]`)?.textContent ?? "").join(" ").trim();
  setTimeout(() => { line.textContent = ""; }, SHOWN);
}

// What the last answer changed in the cell of its question, beside the questions that follow; the waiting screen says more.
function teach({ lesson }) {
  const percent = (chance) => `${Math.round(100 * chance)}\u00a0%`;
  const moves = (lesson?.before ?? []).map((before, way) => [WAYS[way], before, lesson.after[way]])
    .filter(([, before, after]) => Math.abs(after - before) >= LEAST)
    .map(([way, before, after]) => `${way} ${percent(before)} → ${percent(after)}`);
  const words = moves.length ? t("The last answer changed: {moves}", { moves: moves.join(", ") }) : "";
  if (note.textContent !== words) note.textContent = words;
}

async function shown() {
  const reply = await fetch(`/runs/${run}/growth`).catch(() => null); // the next event asks again
  if (!reply?.ok) return null;
  const holder = document.createElement("template");
  holder.innerHTML = await reply.text();
  return holder.content.firstElementChild;
}

async function look() {
  clearTimeout(timer);
  timer = 0;
  if (waiting.hidden) return;
  looked = performance.now();
  const found = await shown();
  if (!found) return;
  part.replaceChildren(found);
  if (said.textContent !== found.dataset.spoken) said.textContent = found.dataset.spoken;
}

// What the run's stream says, and whether the page waits.
export function grown(now, idle) {
  tell(now);
  teach(now);
  const key = `${now.answers}/${now.tick}/${idle}`;
  if (!idle || key === seen || timer) return;
  seen = key;
  timer = setTimeout(look, Math.max(300, looked + EVERY - performance.now()));
}
