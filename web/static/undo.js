// Undo: takes the last answer back while the agent has not heard it, and shows its question again. One that it has heard is
// shown with its mark, by the server's own markup, and what is chosen there takes its place.
import { report } from "./answers.js";
import { keyName } from "./key_names.js";
import { letters } from "./keys.js";
import { ANSWERED, kept, unsaved } from "./kept.js";
import { flush } from "./outbox.js";
import { $, alarm, client, given, inDialog, page, run, speak } from "./page.js";
import { show } from "./questions.js";
import { t } from "./sentences.js";

const PATIENCE = 3000; // ms for which the last answer may still be on its way
const MOST = 20; // answers that can be taken back one after another
const UNSENT = t("Your last answer is not sent yet. Take it back once the server is here again.");
const AWAY = t("The server cannot be reached, so it is not known whether your last answer was taken back. Try again once it is here.");
const OFTEN = 5000; // ms between two looks at what was answered last
const form = $("undo"), answered = [];
let busy = false, looked = -OFTEN, looking = null;
let news = 0, known = 0; // how often something happened that this page does not know of, and how much of it a look has told
let told = null; // what is said of an undo that did not work for the time being: the words, and the answer that they wait for

// Undo is offered where there is an answer to take back. A run that is over asks nothing again.
function offer() {
  form.hidden = !form.elements.question.value || page.state === "over" || Boolean(page.current?.dataset.former);
}

function name(query, said) {
  form.elements.question.value = query;
  $("undone").textContent = said;
  offer();
}

function nameLast() {
  const last = answered.at(-1);
  if (last) name(last.question.dataset.query, last.question.querySelector(`[data-said][value=${last.choice}]`).dataset.said);
  else name("", "");
}

export function remember(question, choice) {
  if (stale()) forget();
  known = news; // this answer is the last one
  answered.push({ question: question.cloneNode(true), choice });
  if (answered.length > MOST) answered.shift();
  nameLast();
}

// What this page remembers does not follow one another: answers of another tab come between.
function forget(kept = 0) {
  answered.splice(0, answered.length - kept);
}

// An answer is stored; any tab's outbox may have sent it.
export function stored(at, query) {
  try { localStorage.setItem(ANSWERED, `${at} ${query} ${Date.now()}`); } catch { /* no storage: then tabs know of their own answers alone */ }
  if (at === run && !answered.some(({ question }) => question.dataset.query === query)) news++;
}

// The last answer may be another one than this page knows.
const stale = () => known < news;

// Take over what the page would offer if it were loaded now.
async function read() {
  const last = answered.at(-1), all = news;
  looked = performance.now();
  const markup = await fetch(`/runs/${run}/parent`).then((reply) => (reply.ok ? reply.text() : "")).catch(() => "");
  const holder = document.createElement("template");
  holder.innerHTML = markup;
  const found = holder.content.getElementById("undo");
  if (!found || last !== answered.at(-1)) return; // an answer was given meanwhile: that is the last
  known = all;
  const query = found.elements.question.value;
  forget(query === last?.question.dataset.query ? 1 : 0);
  name(query, found.querySelector("#undone").textContent);
}

function look() {
  looking ??= read().finally(() => { looking = null; });
  return looking;
}

// A look that is under way may know too little, and then another one follows.
async function learn() {
  for (let turn = 0; turn < 2 && stale(); turn++) await look();
}

// The run has changed.
export function heed() {
  offer();
  if (stale() && !unsaved() && !document.hidden && performance.now() - looked > OFTEN) look();
}

// What hindered an undo is over: the server is here again, or has that answer now.
export function relieve(stored = null) {
  if (!told || (told.query && told.query !== stored)) return;
  if ($("alert").textContent === told.words) $("alert").textContent = "";
  told = null;
}

function hinder(words, query = null) {
  told = { words, query };
  return new Error(words);
}

const again = (query, more = "") => location.assign(`/runs/${run}/parent?query=${query}${more}`);

const patient = (promise) => Promise.race([promise, new Promise((done) => { setTimeout(done, PATIENCE); })]);

// Wait until the last answer is known: those of other tabs are sent, too.
async function catchUp(query) {
  await patient(flush(report));
  if (kept().includes(query)) throw hinder(UNSENT, query);
  await patient(learn());
  if (stale()) throw hinder(AWAY);
}

// An answer is no more to be taken back; the one before is.
function strike(query) {
  const place = answered.map(({ question }) => question.dataset.query).lastIndexOf(query); // one may have been given meanwhile
  const [struck] = place < 0 ? [] : answered.splice(place, 1);
  nameLast();
  if (!answered.length) {
    news++;
    learn();
  }
  return struck;
}

async function withdraw(query) {
  const [reply, found] = await fetch(`/api/v1/queries/${query}/withdraw`, {
    method: "POST", headers: { "content-type": "application/json" },
    body: JSON.stringify({ client_id: client, database: form.elements.database.value, run, question: query }),
  }).then(async (reply) => [reply, await reply.json()]).catch(() => { throw hinder(AWAY); });
  if (found.error?.code === "conflict") strike(query);
  if (!reply.ok) throw new Error(found.error.message);
  return found.outcome;
}

async function undo() {
  if (busy || form.hidden) return;
  busy = true;
  $("alert").textContent = "";
  told = null;
  const query = form.elements.question.value;
  try {
    await catchUp(query);
    if (form.elements.question.value !== query) return speak(form.textContent); // another answer came later: who wants that one back says so
    if (await withdraw(query) === "heard") return again(query, "&change=true");
    const last = strike(query);
    if (!last || last.question.dataset.former) return again(query);
    given.delete(query);
    $("saved").textContent = t("Taken back");
    show(last.question);
  } catch ({ message }) {
    alarm(message);
  } finally { busy = false; }
}

addEventListener("online", () => relieve());
addEventListener("storage", ({ key, newValue }) => {
  const [at, query] = newValue?.split(" ") ?? [];
  if (key !== ANSWERED || at !== run) return;
  news++;
  relieve(query);
  heed();
});
addEventListener("pageshow", ({ persisted }) => { // meanwhile it heard of nothing
  if (!persisted) return;
  news++;
  heed();
});
form.addEventListener("submit", (event) => {
  event.preventDefault();
  undo();
});
addEventListener("keydown", (event) => {
  if (keyName(event) !== "z" || !letters.on || event.repeat || event.isComposing || inDialog()) return;
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, textarea, select, [contenteditable]")) return;
  undo();
});
