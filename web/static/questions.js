// Questions: fetches them, keeps one ahead, and puts them on the stage.
// The markup of a question comes from the server (drawing/board.py says why); this file swaps it in.
import { settle } from "./answers.js";
import { begin } from "./begin.js";
import { kept } from "./outbox.js";
import { client, given, main, name, page, painted, PATIENCE, run, stage, waiting } from "./page.js";
import { attentive, leave } from "./presence.js";
import { wait } from "./waiting.js";

const LOOKOUT = 5; // seconds that the request for the question after this one may lie at the server, while somebody thinks

// The form of the most urgent question, besides those that were answered here; null if there is none within `seconds`.
async function ask(shown = [], seconds = 0, signal = undefined, more = {}) {
  const body = new URLSearchParams({ client_id: client, wait: seconds, ...more });
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
export async function next(seconds = 0) {
  page.again = page.asking;
  if (page.asking) return;
  page.asking = true;
  try {
    let form;
    do {
      page.again = false;
      form = await ask([], seconds);
      seconds = 0;
    } while (!form && page.again && !page.current);
    if (form && !page.current) show(form);
    else if (!page.current && page.state === "question") wait(kept().length ? "unsent" : page.taken ? "taken" : "elsewhere");
    else if (!page.current) wait(page.state);
  } catch (error) {
    failed(error);
  } finally { page.asking = false; }
}

function failed({ status }) {
  if (status === 500) wait("damaged");
  else wait(status === 404 ? "away" : "offline");
}

// Answer here instead: the question comes here, whoever has it.
export async function take() {
  const form = await ask([], 0, undefined, { take: true }).catch(failed);
  if (form && !page.current) show(form);
}

// The question after this one: its request lies at the server while somebody thinks, so that its reply leaves as soon as
// the agent asks.
export async function prefetch() {
  if (!page.current || !attentive()) return;
  page.lookout?.abort();
  const mine = page.lookout = new AbortController(), form = page.current, began = performance.now();
  form.dataset.ahead = "";
  const found = await ask([form.dataset.query], LOOKOUT, mine.signal).catch(() => null);
  if (mine !== page.lookout) return;
  page.lookout = null;
  if (form === page.current) {
    page.ahead = found;
    form.dataset.ahead = found?.dataset.query ?? "";
    if (!found && performance.now() - began > 1000 * PATIENCE) prefetch();
  } else if (!page.current) {
    if (found) show(found);
    else next(PATIENCE);
  }
}

export function show(form) {
  if (!form.isConnected) stage.replaceChildren(form);
  clearTimeout(page.quiet);
  page.quiet = 0;
  page.ahead = null;
  page.taken = false;
  waiting.hidden = true;
  stage.hidden = false;
  main.dataset.state = "question";
  document.title = `● ${form.dataset.title} · ${name}`;
  settle();
  begin(form);
  performance.mark("question", { detail: form.dataset.query });
  painted(prefetch);
  if (document.hidden) leave(); // the title tells of it, and others need not wait
}
