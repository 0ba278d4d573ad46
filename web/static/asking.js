// Asks for a question and puts it on the stage: all that the first painting needs.
// The markup of a question comes from the server (drawing/board.py says why).
import { kept } from "./kept.js";
import { $, client, given, main, name, page, run, stage, waiting } from "./page.js";
import { size } from "./size.js";

// The form of the most urgent question, besides those that were answered here; null if there is none now.
export async function ask(shown = [], signal = undefined, more = {}) {
  const body = new URLSearchParams({ client_id: client, ...more });
  for (const query of new Set([...shown, ...kept()])) body.append("shown", query);
  const reply = await fetch(`/runs/${run}/parent/question`, { method: "POST", body, signal });
  if (!reply.ok) throw Object.assign(new Error(reply.statusText), { status: reply.status });
  if (reply.status === 204) return null;
  return formOf(await reply.text());
}

export function formOf(markup) {
  const holder = document.createElement("template");
  holder.innerHTML = markup;
  const form = holder.content.firstElementChild;
  return given.has(form.dataset.query) ? null : form; // two requests may bring the same question, one of them late
}

// Take note of when a question is seen: once it is painted, which a page waits for that nobody looks at.
function see(form) {
  const now = () => { if (page.put === form) page.seen = { at: Date.now(), by: performance.now() }; };
  now();
  requestAnimationFrame(() => setTimeout(now));
}

export function put(form) {
  if (page.put === form) return;
  page.put = form;
  see(form);
  if (!form.matches(".one")) form.dataset.side = "left";
  if (!form.isConnected) stage.replaceChildren(form);
  waiting.hidden = true;
  stage.hidden = false;
  size(form);
  main.dataset.state = "question";
  document.title = `● ${form.dataset.title} · ${name}`;
  $("said").textContent = form.dataset.spoken;
}
