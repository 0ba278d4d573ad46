// The parent's page: shows one question after another, takes keys and clicks, and says who waits for whom.
// The markup of a question comes from the server (drawing/board.py says why); this file swaps it in.
import { recordAnswer, timeLeft } from "./eta.js";
import { follow } from "./live.js";
import { flush, flushAll, keep, kept } from "./outbox.js";
import { play } from "./play.js";

const $ = (id) => document.getElementById(id);
const main = $("main"), stage = $("stage"), waiting = $("waiting"), help = $("help");
const { run, client, name } = main.dataset;
const KEYS = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "either", ArrowDown: "neither", 1: "left", 2: "right", 3: "either", 4: "neither" };
const RENEW = 25_000;
const PATIENCE = 1; // seconds that a request for a question may lie at the server
const LOOKOUT = 5; // the same for the one after it, while somebody thinks
const HASTE = 40;   // ms after an answer when the next question is asked for, if the answer's reply is not there before
const CALM = 60;   // ms after a question is painted when the page turns to what nobody waits for
const ELSEWHERE = "An answer is meant for another database than the one that is served here. It was not stored; this browser keeps it.";
const QUIET = 350; // an answered question stays this long before the page says that the agent explores

let current = null;    // the form on the stage, until it is answered
let player = null;
let ahead = null;      // the form after it
let lookout = null;    // aborts the request for it, which lies at the server
let asking = false, again = false; // a request for a question is under way; another was wanted meanwhile
let state = main.dataset.state;
let answered = Number($("count").textContent), goal = Number($("goal").firstElementChild.textContent), unsaved = 0, quiet = 0;
const given = new Set(); // questions that were answered on this page
const saved = []; // replies to answers, until the stage changes

// ---- questions

// The form of the most urgent question, besides those that were answered here; null if there is none within `seconds`.
async function ask(shown = [], seconds = 0, signal = undefined) {
  const body = new URLSearchParams({ client_id: client, wait: seconds });
  for (const query of new Set([...shown, ...kept()])) body.append("shown", query);
  const reply = await fetch(`/runs/${run}/parent/question`, { method: "POST", body, signal });
  if (!reply.ok) throw Object.assign(new Error(reply.statusText), { status: reply.status });
  if (reply.status === 204) return null;
  const holder = document.createElement("template");
  holder.innerHTML = await reply.text();
  const form = holder.content.firstElementChild;
  return given.has(form.dataset.query) ? null : form; // two requests may bring the same question, one of them late
}

// Fill the empty stage. One request at a time; what comes meanwhile is asked for once more.
async function next(seconds = 0) {
  again = asking;
  if (asking) return;
  asking = true;
  try {
    let form;
    do {
      again = false;
      form = await ask([], seconds);
      seconds = 0;
    } while (!form && again && !current);
    if (form && !current) show(form);
    else if (!current) wait(state === "question" ? "elsewhere" : state);
  } catch ({ status }) {
    if (status === 500) wait("damaged");
    else wait(status === 404 ? "away" : "offline");
  } finally { asking = false; }
}

// The question after this one: its request lies at the server while somebody thinks, so that its reply leaves as soon as
// the agent asks.
async function prefetch() {
  if (!current || document.hidden) return;
  lookout?.abort();
  const mine = lookout = new AbortController(), form = current, began = performance.now();
  form.dataset.ahead = "";
  const found = await ask([form.dataset.query], LOOKOUT, mine.signal).catch(() => null);
  if (mine !== lookout) return;
  lookout = null;
  if (form === current) {
    ahead = found;
    form.dataset.ahead = found?.dataset.query ?? "";
    if (!found && performance.now() - began > 1000 * PATIENCE) prefetch();
  } else if (!current) {
    if (found) show(found);
    else next(PATIENCE);
  }
}

// A question is held for a minute, and for longer while somebody looks at it.
async function renew() {
  if (!current || document.hidden) return;
  await ask().catch(() => null);
  if (!lookout) prefetch();
}

function show(form) {
  const focused = stage.querySelector(".answers :focus-visible")?.value;
  if (!form.isConnected) stage.replaceChildren(form);
  clearTimeout(quiet);
  quiet = 0;
  current = form;
  ahead = null;
  waiting.hidden = true;
  stage.hidden = false;
  main.dataset.state = "question";
  document.title = `● ${form.dataset.title} · ${name}`;
  $("said").textContent = form.dataset.spoken;
  settle();
  player = play(form);
  if (focused) form.querySelector(`.answers [value=${focused}]`).focus();
  performance.mark("question", { detail: form.dataset.query });
  painted(prefetch);
}

// Do something once the stage is painted: until then the page has nothing else to do.
function painted(then) {
  let timer = 0;
  const once = () => { clearTimeout(timer); then?.(); then = null; };
  requestAnimationFrame(() => setTimeout(once, CALM));
  timer = setTimeout(once, 5 * CALM); // a hidden page is never painted
}

// ---- waiting

function wait(which) {
  if (current) return;
  main.dataset.state = which;
  for (const part of waiting.querySelectorAll(":scope > [data-state]")) part.hidden = part.dataset.state !== which;
  waiting.setAttribute("aria-labelledby", `waiting-${which}`);
  if (!waiting.hidden) return announce(which);
  quiet ||= setTimeout(() => {
    quiet = 0;
    settle();
    if (current) return;
    stage.replaceChildren();
    waiting.hidden = false;
    announce(main.dataset.state);
  }, stage.childElementCount ? QUIET : 0);
}

function announce(which) {
  const words = $(`waiting-${which}`).textContent;
  document.title = `${words} · ${name}`;
  if ($("said").textContent !== words) $("said").textContent = words;
}

const tell = {
  run(now) {
    if (state === "offline" || state === "away") flushAll(report);
    state = now.state;
    goal = now.goal;
    if (now.reason) $("reason").textContent = now.reason;
    $("optimal").hidden = !now.optimal || state === "over";
    count(now.answers);
    if (current && state === "over") current = null;
    if (current) {
      if (!ahead && !lookout && now.open.guidance + now.open.preference > 1) prefetch();
      return;
    }
    if (state === "question") next();
    else wait(state);
  },
  question(asked) {
    if (!asked) return;
    if (!current) next();
    else if (asked.kind === "guidance" && asked.public_id !== current.dataset.query && !lookout) prefetch(); // it goes first
  },
  lost(status) {
    state = status === 404 ? "away" : "offline";
    wait(state);
  },
};

// ---- answers

function count(number) {
  answered = Math.max(answered, number);
  $("count").textContent = answered;
  $("goal").hidden = !goal;
  $("goal").firstElementChild.textContent = goal ?? "";
  $("left").textContent = timeLeft(goal - answered);
  for (const button of waiting.querySelectorAll("[data-more]")) button.value = goal + Number(button.dataset.more);
}

function answer(choice) {
  if (!current) return;
  const { database, query } = current.dataset;
  given.add(query);
  for (const button of current.querySelectorAll(`[value=${choice}]`)) button.classList.add("chosen");
  current = null;
  unsaved++;
  $("saved").textContent = "Saving";
  $("alert").textContent = "";
  performance.mark("answer", { detail: query });
  recordAnswer();
  keep({ database, run, question: query, choice, client_id: client });
  if (ahead) {
    painted(() => flush(report));
    return show(ahead);
  }
  player.still();
  Promise.race([flush(report), new Promise((done) => { setTimeout(done, HASTE); })]).then(() => { if (!current && !lookout) next(PATIENCE); });
  wait(state === "question" ? "exploring" : state);
}

// A page that changes twice is painted twice: what was saved is told together with the next question, if that comes soon.
function settle() {
  for (const reply of saved.splice(0)) report("saved", reply);
}

function report(outcome, reply, answer) {
  if (outcome === "saved" && quiet) return saved.push(reply);
  $("saved").classList.toggle("kept", outcome === "kept");
  if (outcome === "kept") {
    $("saved").textContent = "Kept here, not sent yet";
    if (!current) wait("offline");
    return;
  }
  unsaved = Math.max(0, unsaved - 1);
  if (outcome === "saved") {
    if (reply.run_public_id === run) count(reply.number);
    if (!unsaved) $("saved").textContent = "Saved";
  } else {
    if (!unsaved) $("saved").textContent = outcome === "elsewhere" ? "Kept here, not stored" : "";
    $("alert").textContent = outcome === "elsewhere" ? ELSEWHERE : reply.message;
    if (outcome === "elsewhere" && given.delete(answer.question) && !current) next(); // a copy of its database asks the same
  }
}

// ---- keys and clicks

stage.addEventListener("submit", (event) => {
  event.preventDefault();
  answer(event.submitter.value);
});

addEventListener("keydown", (event) => {
  const { key, target } = event;
  if (event.repeat && target.closest?.("#stage")) event.preventDefault(); // a key held down presses no button twice
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || event.isComposing || help.open) return;
  if (target.closest("input, textarea, select, [contenteditable]")) return;
  if (key === "?") help.showModal();
  else if (key === " " && !target.closest("button, a, summary")) player?.replay();
  else if (KEYS[key] && !event.shiftKey && current) answer(KEYS[key]);
  else return;
  event.preventDefault();
});

$("help-open").hidden = false;
$("help-open").addEventListener("click", () => help.showModal());

// ---- begin: send what an earlier visit left behind, then follow the run

addEventListener("pagehide", () => flush(report));
document.addEventListener("visibilitychange", () => {
  if (document.hidden) lookout?.abort();
  else if (!ahead) prefetch();
});
history.replaceState(null, "", `/runs/${run}/parent`);
const first = stage.querySelector("#question");
if (first && !kept().includes(first.dataset.query)) show(first);
setInterval(renew, RENEW);
flush(report).then(() => follow(run, tell, { background: true }));
