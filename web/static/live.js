// What the server says of a run, as it happens: a stream of events, or a poll every 500 ms wherever no stream comes through.
const POLL = 500, HIDDEN = 3000;
// A browser opens six connections to a host, and a stream keeps one: with six streams no page loads and no answer is
// sent. So the pages of a browser that only look share two streams, and its parent's pages one (carried.js). The others
// poll, and take a stream over once it is free.
const STREAMS = 2;
const wait = () => new Promise((resolve) => setTimeout(resolve, HIDDEN));

// Runs `use` with one of the streams, as soon as one is free, until what it returns is settled.
async function withStream(use, wanted) {
  while (wanted() && navigator.locks) { // absent outside of localhost and https: then all tabs poll
    for (let one = 0; one < STREAMS; one++) {
      const got = await navigator.locks.request(`parenting-stream-${one}`, { ifAvailable: true }, (lock) => lock && wanted() ? use().then(() => true) : false);
      if (got) return;
    }
    await wait();
  }
}

// Asks for the run while nothing is heard of it; tell.run(run), tell.metrics(rows) and tell.lost(status) hear what came.
// With `background`, a hidden tab goes on asking, slowly; without, it is silent until it is seen again. Returns what asks
// at once.
export function poll(id, tell, heard, background = false) {
  let timer = 0;
  return async function ask() {
    let pause = document.hidden ? HIDDEN : POLL;
    if (!heard()) {
      try {
        const run = await get(`/api/v1/runs/${id}`);
        const found = tell.metrics && (await get(`/api/v1/runs/${id}/metrics?after=${tell.after()}`));
        if (!heard()) { tell.run(run); if (found) tell.metrics(found.rows); }
      } catch ({ status }) {
        if (!heard()) tell.lost(status);
        if (status === 401 || status === 403) pause = HIDDEN; // until somebody has come in again
      }
    }
    clearTimeout(timer);
    if (!document.hidden || background) timer = setTimeout(ask, pause);
  };
}

// Calls tell.run(run) with every change, tell.metrics(rows) for the ticks after tell.after(), and tell.lost() while the
// server cannot be reached, each time after tell.ready(), if there is one, has settled. For pages that only look.
export function follow(id, tell) {
  let stream = null, heard = false, turns = 0, release = () => {};
  const on = (event, use) => stream.addEventListener(event, ({ data }) => { heard = true; use(JSON.parse(data)); });
  const open = () => {
    stream = new EventSource(`/api/v1/runs/${id}/events?after=${tell.after()}`);
    on("run", tell.run);
    on("metrics", ({ rows }) => tell.metrics(rows));
    stream.addEventListener("error", () => { heard = false; });
    return new Promise((resolve) => { release = resolve; });
  };
  const close = () => {
    stream?.close();
    stream = null;
    heard = false;
    release();
  };
  const ask = poll(id, tell, () => heard);
  const turn = async () => {
    const now = ++turns;
    close();
    if (!document.hidden) await tell.ready?.();
    if (now !== turns) return;
    if (!document.hidden) withStream(open, () => now === turns && !document.hidden);
    ask();
  };
  addEventListener("pagehide", () => { turns++; close(); });
  document.addEventListener("visibilitychange", turn);
  turn();
}

async function get(path) {
  const reply = await fetch(path);
  if (!reply.ok) throw Object.assign(new Error(reply.statusText), { status: reply.status });
  return reply.json();
}
