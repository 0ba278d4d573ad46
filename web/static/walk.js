// Watch it walk: the present policy plays an episode, which a worker computes and the server draws. The life goes on, or
// waits, as if nobody watched. Nothing here is loaded before somebody asks for it.
import { t } from "./sentences.js";

const TEXTS = {
  ready: t("The agent gets ready."),
  no_worker: t("No worker is running, so the agent cannot walk. It begins once one is started (parenting worker)."),
  gone: t("The server does not answer. Try again."),
  waits: t("A question is waiting."),
};
const POLL = 100, SLOW = 500, SOON = 20; // ms between two looks: at first, and after so many looks
const STEP = 520, WHOLE = 15000, QUICKEST = 160; // ms of a step; a long walk is quicker, so that it ends in time
const main = document.getElementById("main"), stage = document.getElementById("stage");
const { run, client } = main.dataset;
let dialog = null, player = null, turn = 0;

function opened() {
  if (dialog) return dialog;
  dialog = document.createElement("dialog");
  dialog.className = "watch";
  dialog.setAttribute("aria-labelledby", "watch-title");
  dialog.innerHTML = `<h1 id="watch-title">${t("Watch it walk")}</h1><p class="waits" role="status"></p><p class="quiet state" role="status"></p>
<div class="shown"></div><div class="beside"><button type="button" data-again>${t("Another walk")}</button><button type="button" class="primary" data-close>${t("Close")}</button></div>`;
  document.body.append(dialog);
  dialog.querySelector("[data-close]").addEventListener("click", () => dialog.close());
  dialog.querySelector("[data-again]").addEventListener("click", walk);
  dialog.addEventListener("close", still);
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

async function reply(path, options) {
  const found = await fetch(path, options).catch(() => { throw new Error(TEXTS.gone); });
  if (!found.ok) throw new Error((await found.json().catch(() => null))?.error?.message ?? TEXTS.gone);
  return found;
}

// The job of a walk, once it is over.
async function walked(mine) {
  const body = JSON.stringify({ client_id: client, kind: "walk", payload: { seed: Math.floor(Math.random() * 2 ** 31) } });
  let job = await (await reply(`/api/v1/runs/${run}/jobs`, { method: "POST", headers: { "content-type": "application/json" }, body })).json();
  for (let looks = 0; job.state === "waiting" || job.state === "working"; looks++) {
    if (mine !== turn) return null;
    say(job.worker === "silent" ? TEXTS.no_worker : TEXTS.ready);
    await new Promise((done) => { setTimeout(done, looks < SOON ? POLL : SLOW); });
    job = await (await reply(`/api/v1/jobs/${job.id}`)).json();
  }
  if (job.state === "failed") throw new Error(job.reason);
  return job;
}

let play = null;

async function walk() {
  still();
  const mine = turn, again = dialog.querySelector("[data-again]"), shown = dialog.querySelector(".shown");
  again.disabled = true;
  say(TEXTS.ready);
  try {
    const job = await walked(mine);
    if (!job || mine !== turn) return;
    shown.innerHTML = await (await reply(`/runs/${run}/walk/${job.id}/board`)).text();
    if (mine !== turn) return;
    const view = shown.firstElementChild, steps = job.result.clip.length;
    say(view.dataset.spoken);
    view.querySelector(".told").hidden = true;
    view.classList.add("played");
    if (steps) player = play(view.querySelector(".walked"), null, Math.max(QUICKEST, Math.min(STEP, WHOLE / steps)));
  } catch ({ message }) {
    if (mine === turn) say(message);
  } finally { if (mine === turn) again.disabled = false; }
}

// A question that comes meanwhile is told of; it stays where it is until the dialog is closed.
new MutationObserver(() => {
  if (dialog?.open) dialog.querySelector(".waits").textContent = stage.querySelector("#question") ? TEXTS.waits : "";
}).observe(stage, { childList: true });

// Open the dialog and let it walk; `player` is the one of the page's boards.
export function watch(player) {
  play = player;
  if (opened().open) return;
  dialog.querySelector(".waits").textContent = "";
  dialog.querySelector(".shown").replaceChildren();
  dialog.showModal();
  walk();
}
