// How far the agent has come: milestones are told once in a browser, and the waiting screen shows the growth line and what
// the last answer changed. Nothing here is loaded before the first answer.
const EVERY = 3000, SHOWN = 7000; // ms between two looks at the line, and for which a milestone stays on the screen
const main = document.getElementById("main"), waiting = document.getElementById("waiting");
const { run } = main.dataset, KEY = `parenting.told.${run}`;
const line = Object.assign(document.createElement("p"), { className: "news" });
const part = document.createElement("div"), said = Object.assign(document.createElement("p"), { className: "sr" });
let seen = "", looked = 0, timer = 0;

line.setAttribute("role", "status");
said.setAttribute("role", "status");
main.append(line);
waiting.append(part, said);

const told = new Set((() => { try { return JSON.parse(localStorage.getItem(KEY)) ?? []; } catch { return []; } })());

function remember(name) {
  told.add(name);
  try { localStorage.setItem(KEY, JSON.stringify([...told])); } catch { /* then it is told again on the next page */ }
}

// Milestones that this browser has not told yet, in the server's words.
async function tell(now) {
  const fresh = Object.keys(now.milestones ?? {}).filter((name) => !told.has(name));
  if (!fresh.length) return;
  fresh.forEach(remember);
  const found = await shown();
  line.textContent = fresh.map((name) => found?.querySelector(`[data-milestone="${name}"]`)?.textContent ?? "").join(" ").trim();
  setTimeout(() => { line.textContent = ""; }, SHOWN);
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
  const key = `${now.answers}/${now.tick}/${idle}`;
  if (!idle || key === seen || timer) return;
  seen = key;
  timer = setTimeout(look, Math.max(300, looked + EVERY - performance.now()));
}
