// Undo: takes the last answer back while the agent has not heard it, and shows its question again. One that it has heard is
// shown with its mark, by the server's own markup, and the form there changes it.
import { report } from "./answers.js";
import { keyName } from "./key_names.js";
import { letters } from "./keys.js";
import { kept } from "./kept.js";
import { measure } from "./measuring.js";
import { flush } from "./outbox.js";
import { $, alarm, client, given, inDialog, page, run } from "./page.js";
import { show } from "./questions.js";
import { t } from "./sentences.js";

const PATIENCE = 3000; // ms for which the last answer may still be on its way
const MOST = 20; // answers that can be taken back one after another
const UNSENT = t("Your last answer is not sent yet. Take it back once the server is here again.");
const form = $("undo"), answered = [];
let busy = false;

function offer() {
  const last = answered.at(-1);
  form.hidden = !last;
  if (!last) return;
  form.elements.question.value = last.question.dataset.query;
  $("undone").textContent = last.question.querySelector(`[data-said][value=${last.choice}]`).dataset.said;
}

export function remember(question, choice) {
  answered.push({ question: question.cloneNode(true), choice });
  if (answered.length > MOST) answered.shift();
  offer();
}

// Send the form of an answer that is changed, with what was measured of it.
export function change(question, choice) {
  question.elements.replays.value = page.player?.replays ?? "";
  question.elements.measured.value = JSON.stringify({ ...measure(question), queued: 0 });
  question.requestSubmit(question.querySelector(`.answers [value=${choice}]`));
}

const again = (query, more = "") => location.assign(`/runs/${run}/parent?query=${query}${more}`);

async function withdraw(query) {
  await Promise.race([flush(report), new Promise((done) => { setTimeout(done, PATIENCE); })]);
  if (kept().includes(query)) throw new Error(UNSENT);
  const reply = await fetch(`/api/v1/queries/${query}/withdraw`, {
    method: "POST", headers: { "content-type": "application/json" },
    body: JSON.stringify({ client_id: client, database: form.elements.database.value, run, question: query }),
  }).catch(() => { throw new Error(UNSENT); });
  const found = await reply.json();
  if (!reply.ok) throw new Error(found.error.message);
  return found.outcome;
}

async function undo() {
  if (busy || form.hidden) return;
  busy = true;
  $("alert").textContent = "";
  const query = form.elements.question.value;
  try {
    if (await withdraw(query) === "heard") return again(query, "&change=true");
    const last = answered.pop();
    if (!last) return again(query);
    offer();
    given.delete(query);
    $("saved").textContent = t("Taken back");
    show(last.question);
  } catch ({ message }) {
    alarm(message);
  } finally { busy = false; }
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  undo();
});
addEventListener("keydown", (event) => {
  if (keyName(event) !== "z" || !letters.on || event.repeat || event.isComposing || inDialog()) return;
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, textarea, select, [contenteditable]")) return;
  undo();
});
