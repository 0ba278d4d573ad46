// Questions: keeps one ahead, and swaps one for the next.
import { settle } from "./answers.js";
import { ask, formOf, put } from "./asking.js";
import { begin } from "./begin.js";
import { kept } from "./kept.js";
import { given, page, painted } from "./page.js";
import { attentive, leave } from "./presence.js";
import { lostState, wait } from "./waiting.js";

const BROUGHT = 400; // ms for which a stream may still bring the question that is known to wait

// Fill the empty stage. One request at a time; what comes meanwhile is asked for once more. A stream brings what there is
// by itself; what it did not bring, such as a question that another tab has, is asked for a little later.
export async function next() {
  if (page.carried()) {
    await new Promise((done) => { setTimeout(done, BROUGHT); });
    if (page.current) return;
  }
  page.again = page.asking;
  if (page.asking) return;
  page.asking = true;
  try {
    let form;
    do {
      page.again = false;
      form = await ask();
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
  else wait(lostState(status));
}

// Answer here instead: the question comes here, whoever has it.
export async function take() {
  const form = await ask([], undefined, { take: true }).catch(failed);
  if (form && !page.current) show(form);
}

// The question after this one, where no stream brings it.
export async function prefetch() {
  if (!page.current || !attentive() || page.carried()) return;
  page.lookout?.abort();
  const mine = page.lookout = new AbortController(), form = page.current;
  form.dataset.ahead = "";
  const found = await ask([form.dataset.query], mine.signal).catch(() => null);
  if (mine !== page.lookout) return;
  page.lookout = null;
  if (form === page.current) {
    page.ahead = found;
    form.dataset.ahead = found?.dataset.query ?? "";
  } else if (!page.current) {
    if (found) show(found);
    else next();
  }
}

// The questions of this page besides one, the agent's guidance first: it waits for that.
function behind(form, ...more) {
  const others = [page.current, page.ahead, ...page.later, ...more].filter((one) =>
    one && one.dataset.query !== form.dataset.query && !one.dataset.former && !given.has(one.dataset.query));
  return [...others.filter(({ dataset }) => dataset.kind === "guidance"), ...others.filter(({ dataset }) => dataset.kind !== "guidance")];
}

// A question that the stream brought: it is shown, or waits behind the one that is.
export function arrive(markup) {
  const form = formOf(markup), here = [page.current, page.ahead, ...page.later];
  if (!form || here.some((one) => one?.dataset.query === form.dataset.query)) return;
  if (!page.current) return show(form);
  [page.ahead = null, ...page.later] = behind(page.current, form);
  page.current.dataset.ahead = page.ahead?.dataset.query ?? "";
}

export function show(form) {
  put(form);
  clearTimeout(page.quiet);
  page.quiet = 0;
  [page.ahead = null, ...page.later] = page.carried() ? behind(form) : [];
  form.dataset.ahead = page.ahead?.dataset.query ?? "";
  page.taken = false;
  settle();
  begin(form);
  performance.mark("question", { detail: form.dataset.query });
  painted(prefetch);
  if (document.hidden) leave(); // the title tells of it, and others need not wait
}
