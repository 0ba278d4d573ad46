// Answers: takes one for the question on the stage, keeps it, sends it, and says what became of it.
import { listens } from "./arming.js";
import { recordAnswer, timeLeft } from "./eta.js";
import { ANSWERED, keep, unsaved } from "./kept.js";
import { measure } from "./measuring.js";
import { flush } from "./outbox.js";
import { number } from "./numbers.js";
import { $, alarm, client, given, name, page, painted, run, waiting } from "./page.js";
import { next, show } from "./questions.js";
import { remark } from "./remarks.js";
import { t } from "./sentences.js";
import { heed, relieve, remember, stored } from "./undo.js";
import { wait } from "./waiting.js";

const HASTE = 40; // ms after an answer when the next question is asked for, if the answer's reply is not there before
const OTHERS_FIRST = 300; // ms after a skip in which other parents may have the next question
const BELONGS = t("It was not stored; this browser keeps it and sends it once its own database is back.");

const OTHER_LINK = t("An answer was given here under another link than yours. It was not stored; this browser keeps it and sends it once that link is opened again.");

function elsewhere({ database, title, given: at }) {
  const values = { title, date: new Date(at).toLocaleString(), name: database?.slice(0, 8) ?? t("of an older version") };
  const named = title ? t("Your answer to “{title}” of {date} belongs to the database {name}, which is not the one that is served here.", values)
    : t("An answer belongs to the database {name}, which is not the one that is served here.", values);
  return `${named} ${BELONGS}`;
}

const saved = []; // replies and their answers, until the stage changes

export function count(answered, retracted = 0) {
  page.answers = Math.max(page.answers, answered);
  page.retracted = Math.max(page.retracted, retracted);
  const standing = page.answers - page.retracted;
  $("count").textContent = number(standing);
  $("goal").hidden = !page.goal;
  $("goal").firstElementChild.textContent = page.goal ? number(page.goal) : "";
  $("left").textContent = timeLeft(page.goal - standing);
  for (const button of waiting.querySelectorAll("[data-more]")) button.value = page.goal + Number(button.dataset.more);
}

export function answer(choice) {
  if (!listens(page.current)) return;
  const question = page.current, { database, query, former } = question.dataset, change = Boolean(former);
  const measured = measure(question);
  page.current = null;
  remember(question, choice);
  if (!change) remark(question, choice, performance.now() - page.shown);
  given.add(query);
  for (const button of question.querySelectorAll("[aria-pressed][value]")) button.removeAttribute("aria-pressed");
  for (const button of question.querySelectorAll(`[value=${choice}]`)) button.classList.add("chosen");
  $("saved").textContent = t("Saving");
  $("alert").textContent = "";
  performance.mark("answer", { detail: query });
  if (choice !== "skip" && !change) recordAnswer();
  keep({ database, run, question: query, choice, change, replays: page.player?.replays, measured, client_id: client, title: name, given: Date.now() });
  if (page.ahead) {
    painted(() => flush(report));
    return show(page.ahead);
  }
  page.player.still();
  Promise.race([flush(report), new Promise((done) => { setTimeout(done, HASTE); })]).then(() => choice === "skip" && new Promise((done) => { setTimeout(done, OTHERS_FIRST); })).then(() => { if (!page.current && !page.lookout) next(); });
  wait(page.state === "question" ? "exploring" : page.state);
}

// A page that changes twice is painted twice: what was saved is told together with the next question, if that comes soon.
export function settle() {
  for (const told of saved.splice(0)) tell("saved", ...told);
}

export function report(outcome, reply, answer) {
  if (outcome === "saved") stored(reply.run_public_id, answer.question);
  tell(outcome, reply, answer);
}

function tell(outcome, reply, answer) {
  if (reply?.outcome === "put_back" && given.delete(reply.query_public_id) && !page.current) next(); // it is shown once more
  if (outcome === "saved" && page.quiet) return saved.push([reply, answer]);
  $("saved").classList.toggle("kept", outcome === "kept");
  if (outcome === "kept") {
    $("saved").textContent = t("Kept here, not sent yet");
    if (!page.current) wait(reply.state);
    return;
  }
  relieve(answer.question);
  if (outcome === "saved") {
    if (reply.run_public_id === run && answer.choice !== "skip" && !answer.change) count(reply.number);
    heed();
    if (!unsaved()) $("saved").textContent = t("Saved");
  } else {
    if (!unsaved()) $("saved").textContent = outcome === "elsewhere" ? t("Kept here, not stored") : "";
    alarm(outcome !== "elsewhere" ? reply.message : reply?.code === "not_allowed" ? OTHER_LINK : elsewhere(answer));
    if (outcome === "elsewhere" && given.delete(answer.question) && !page.current) next(); // a copy of its database asks the same
  }
}

// The outbox of another tab may have sent what this page waits for, or given it up.
function look({ key, newValue }) {
  const line = $("saved"), sent = key === ANSWERED && given.has(newValue?.split(" ")[1]);
  if (unsaved() || !(sent || line.classList.contains("kept"))) return;
  line.classList.remove("kept");
  line.textContent = sent ? t("Saved") : "";
}

addEventListener("storage", look);
addEventListener("pageshow", look);
