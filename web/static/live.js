// What the server says of a run, as it happens: a stream of events, or a poll every 500 ms wherever no stream comes through.
const POLL = 500, HIDDEN = 3000;
// A browser opens six connections to a host, and a stream keeps one: with six streams no page loads and no answer is
// sent. So all tabs of a browser share three streams; the others poll, and take a stream over once it is free.
const STREAMS = 3;
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

// Calls tell.run(run) with every change, tell.question(question or null) as soon as another one waits, tell.leases(held)
// when a lease begins or ends, tell.metrics(rows) for the ticks after tell.after(), and tell.lost() while the server cannot be reached.
// With `background`, a hidden tab goes on asking, slowly; without, it is silent until it is seen again.
export function follow(id, tell, { background = false } = {}) {
  let stream = null, heard = false, timer = 0, turns = 0, release = () => {};
  const on = (event, use) => stream.addEventListener(event, ({ data }) => { heard = true; use(JSON.parse(data)); });
  const open = () => {
    stream = new EventSource(`/api/v1/runs/${id}/events` + (tell.after ? `?after=${tell.after()}` : ""));
    on("run", tell.run);
    if (tell.question) on("question", tell.question);
    if (tell.leases) on("leases", tell.leases);
    if (tell.metrics) on("metrics", ({ rows }) => tell.metrics(rows));
    stream.addEventListener("error", () => { heard = false; });
    return new Promise((resolve) => { release = resolve; });
  };
  const close = () => {
    stream?.close();
    stream = null;
    heard = false;
    release();
  };
  const poll = async () => {
    if (!heard) {
      try {
        const run = await get(`/api/v1/runs/${id}`);
        const found = tell.metrics && (await get(`/api/v1/runs/${id}/metrics?after=${tell.after()}`));
        if (!heard) { tell.run(run); if (found) tell.metrics(found.rows); }
      } catch ({ status }) { if (!heard) tell.lost(status); }
    }
    clearTimeout(timer);
    if (!document.hidden || background) timer = setTimeout(poll, document.hidden ? HIDDEN : POLL);
  };
  const turn = () => {
    const now = ++turns;
    close();
    if (!document.hidden) withStream(open, () => now === turns && !document.hidden);
    poll();
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
