// Answers on their way. Each is kept in the browser until the server has acknowledged it, and sent again until then.
const KEY = "parenting.answers";
let memory = [], sending = null, delay = 500;

function read() {
  try { return JSON.parse(localStorage.getItem(KEY)) ?? memory; } catch { return memory; }
}

function write(answers) {
  memory = answers;
  try { localStorage.setItem(KEY, JSON.stringify(answers)); } catch { /* no storage: memory holds them while the page lives */ }
}

const wait = (ms) => new Promise((done) => { setTimeout(done, ms); addEventListener("online", done, { once: true }); });

// One attempt: "saved", "refused" (the server said no for good) or "kept" (no connection, or a server in trouble).
async function send({ query, choice, client_id }) {
  try {
    const reply = await fetch(`/api/v1/queries/${query}/answer`, {
      method: "POST", keepalive: true, headers: { "content-type": "application/json" }, body: JSON.stringify({ choice, client_id }),
    });
    if (reply.ok) return ["saved", await reply.json()];
    if (reply.status >= 500 || reply.status === 429) return ["kept"];
    const { error } = await reply.json();
    return ["refused", error];
  } catch {
    return ["kept"];
  }
}

async function drain(report) {
  for (let answers = read(); answers.length; answers = read()) {
    const [outcome, reply] = await send(answers[0]);
    report(outcome, reply);
    if (outcome === "kept") {
      await wait(delay);
      delay = Math.min(5000, delay * 2);
      continue;
    }
    delay = 500;
    write(read().filter((answer) => answer.query !== answers[0].query));
  }
}

// Keep an answer, to be sent.
export function keep(answer) {
  write([...read().filter(({ query }) => query !== answer.query), answer]);
}

// Send whatever is kept, oldest first; resolves when nothing is left.
export function flush(report) {
  sending ??= drain(report).finally(() => { sending = null; });
  return sending;
}

// The questions whose answers are still on their way.
export const kept = () => read().map(({ query }) => query);
