// Questions: keeps one ahead, and swaps one for the next.
import { settle } from "./answers.js";
import { ask, put } from "./asking.js";
import { begin } from "./begin.js";
import { kept } from "./kept.js";
import { page, painted, PATIENCE } from "./page.js";
import { attentive, leave } from "./presence.js";
import { wait } from "./waiting.js";

const LOOKOUT = 5; // seconds that the request for the question after this one may lie at the server, while somebody thinks

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
  put(form);
  clearTimeout(page.quiet);
  page.quiet = 0;
  page.ahead = null;
  page.taken = false;
  settle();
  begin(form);
  performance.mark("question", { detail: form.dataset.query });
  painted(prefetch);
  if (document.hidden) leave(); // the title tells of it, and others need not wait
}
