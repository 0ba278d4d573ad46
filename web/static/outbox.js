// Answers on their way. Each is kept in the browser until the server has acknowledged it, and sent again until then.
// An answer names the database, the run and the question that it is meant for. A server that has another database, or a
// copy with an identity of its own, does not store it; the browser keeps it for the server that does.
import { defer, drop, elsewhere, holds, key, meant, read } from "./kept.js";
import { sent } from "./measuring.js";

const LATE = 15_000; // ms after which a reply is not waited for any more; the answer is sent again
let sending = null, delay = 500;

const wait = (ms) => new Promise((done) => { setTimeout(done, ms); addEventListener("online", done, { once: true }); });

// One attempt: "saved", "refused" (the question has another answer, or was withdrawn), "elsewhere" (it is meant for another
// database or is of another name, or the server cannot read it) or "kept" with the state of the page (no connection, a
// server in trouble, or nobody has come in).
async function send({ database, run, question, choice, change, replays, measured, given, client_id }) {
  if (!question) return ["elsewhere"];
  const late = new AbortController(), timer = setTimeout(() => late.abort(), LATE);
  try {
    const skips = choice === "skip", verb = change ? "change" : skips ? "skip" : "answer", asked = { client_id, database, run, question, measured: sent(measured, given) };
    const reply = await fetch(`/api/v1/queries/${question}/${verb}`, {
      method: "POST", keepalive: true, signal: late.signal, headers: { "content-type": "application/json" },
      body: JSON.stringify(skips ? asked : { choice, replays, ...asked }),
    });
    if (reply.ok) return ["saved", await reply.json()];
    if (reply.status === 401) return ["kept", { state: "refused" }];
    if (reply.status >= 500 || reply.status === 429) return ["kept", { state: "unsent", alone: reply.status === 500 }];
    const { error } = await reply.json();
    return [error.code === "conflict" ? "refused" : "elsewhere", error];
  } catch {
    return ["kept", { state: "offline" }];
  } finally { clearTimeout(timer); }
}

async function drain(report) {
  for (let answers = read().filter(meant); answers.length; answers = read().filter(meant)) {
    const [answer] = answers, [outcome, reply] = await send(answer);
    if (outcome === "kept" && !holds(answer)) continue; // another tab has sent it meanwhile, and said so
    if (outcome === "elsewhere") elsewhere.add(key(answer));
    if (["saved", "refused"].includes(outcome)) drop(answer);
    report(outcome, reply, answer);
    if (outcome === "kept") {
      if (reply.alone) defer(answer); // the fault may be this question's alone: the others go first
      await wait(delay);
      delay = Math.min(5000, delay * 2);
      continue;
    }
    delay = 500;
  }
}

// Send whatever is kept, oldest first; resolves when nothing is left that this server would have.
export function flush(report) {
  sending ??= drain(report).finally(() => { sending = null; });
  return sending;
}

// The server was away, so another one may have come: it is asked again to take what the last one would not have.
export function flushAll(report) {
  elsewhere.clear();
  return flush(report);
}
