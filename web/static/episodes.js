// Episodes: any of the agent's life, shown again from its moves, and one that the present policy plays by itself. A worker
// makes the moves; the server draws them. Nothing here is loaded before somebody asks for it.
import { number as written } from "./numbers.js";
import { play } from "./play.js";
import { job, reply } from "./worker_job.js";

const TEXTS = {
  ready: "A worker makes its moves again.",
  no_worker: "No worker is running. The episode is shown once one is started (parenting worker).",
  none: "No episode of its life is stored yet.",
};
const TITLES = { episode: "Episodes of its life", walk: "The present policy plays" };
const STEP = 520, WHOLE = 15000, QUICKEST = 160; // ms of a step; a long episode is quicker, so that it ends in time
const { run } = document.getElementById("main").dataset;
let dialog = null, player = null, turn = 0;

function made() {
  if (dialog) return dialog;
  const sheet = Object.assign(document.createElement("link"), { rel: "stylesheet", href: document.getElementById("seen").dataset.sheet });
  document.head.append(sheet);
  dialog = document.createElement("dialog");
  dialog.className = "watch";
  dialog.setAttribute("aria-labelledby", "episode-title");
  dialog.innerHTML = `<h1 id="episode-title"></h1>
<form class="which"><button type="button" class="small" data-by="-1" aria-label="The episode before">‹</button>
<label>Episode <input name="number" inputmode="numeric" autocomplete="off" size="5"></label> <span class="quiet" data-of></span>
<button type="button" class="small" data-by="1" aria-label="The episode after">›</button> <button class="small">Show</button></form>
<p class="quiet state" role="status"></p><div class="shown"></div>
<div class="beside"><button type="button" data-again>Another one</button><button type="button" class="primary" data-close>Close</button></div>`;
  document.body.append(dialog);
  dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
  dialog.querySelector("[data-again]").addEventListener("click", () => show("walk", { seed: Math.floor(Math.random() * 2 ** 31) }));
  dialog.addEventListener("close", still);
  const form = dialog.querySelector(".which");
  form.addEventListener("submit", (event) => { event.preventDefault(); number(Number(form.elements.number.value)); });
  for (const button of form.querySelectorAll("[data-by]")) button.addEventListener("click", () => number(Number(form.elements.number.value) + Number(button.dataset.by)));
  return dialog;
}

function still() {
  turn++;
  player?.still();
  player = null;
}

function say(words) {
  const line = dialog.querySelector(".state");
  if (line.textContent !== words) line.textContent = words;
}

// Up to `limit` episodes from that of a number backwards, or from the newest.
async function found(limit, wanted = null) {
  const page = await reply(`/api/v1/runs/${run}/episodes?limit=${limit}${wanted ? `&before=${wanted + 1}` : ""}`);
  return (await page.json()).rows;
}

async function number(wanted) {
  still();
  const mine = turn;
  try {
    const newest = await found(2);
    if (mine !== turn) return;
    if (!newest.length) return say(TEXTS.none);
    const last = newest[0].number, at = Math.max(1, Math.min(last, wanted));
    const [one] = Number.isInteger(wanted) ? await found(1, at) : [newest.at(-1)];
    if (mine !== turn) return;
    dialog.querySelector("[name=number]").value = one.number;
    dialog.querySelector("[data-of]").textContent = `of ${written(last)}`;
    await show("episode", { tick: one.first });
  } catch ({ message }) { if (mine === turn) say(message); }
}

async function show(which, payload) {
  still();
  const mine = turn, shown = dialog.querySelector(".shown");
  say(TEXTS.ready);
  try {
    const done = await job(run, which, payload, (worker) => say(worker === "silent" ? TEXTS.no_worker : TEXTS.ready), () => mine === turn);
    if (!done) return;
    const part = await (await reply(`/runs/${run}/${which === "walk" ? "walk" : "episodes"}/${done.id}/board`)).text();
    if (mine !== turn) return;
    shown.innerHTML = part;
    const view = shown.firstElementChild, steps = done.result.clip.length;
    say(view.dataset.spoken);
    view.querySelector(".told").hidden = true;
    view.classList.add("played");
    if (steps) player = play(view.querySelector(".walked"), null, Math.max(QUICKEST, Math.min(STEP, WHOLE / steps)));
  } catch ({ message }) { if (mine === turn) say(message); }
}

// Open the dialog on the last episode of the life that has ended, or on one of the present policy.
export function open(which) {
  made().querySelector("h1").textContent = TITLES[which];
  dialog.querySelector(".which").hidden = which !== "episode";
  dialog.querySelector("[data-again]").hidden = which !== "walk";
  dialog.querySelector(".shown").replaceChildren();
  dialog.showModal();
  if (which === "episode") number(NaN);
  else show("walk", { seed: Math.floor(Math.random() * 2 ** 31) });
}
