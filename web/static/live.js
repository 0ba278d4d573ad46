// What the server says of a run, as it happens: a stream of events, or a poll every 500 ms wherever no stream comes through.
const POLL = 500, HIDDEN = 3000;

// Calls tell.run(run) with every change, tell.question(question or null) as soon as another one waits, tell.metrics(rows)
// for the ticks after tell.after(), and tell.lost() while the server cannot be reached.
// With `background`, a hidden tab goes on asking, slowly; without, it is silent until it is seen again.
export function follow(id, tell, { background = false } = {}) {
  let stream = null, heard = false, timer = 0;
  const on = (event, use) => stream.addEventListener(event, ({ data }) => { heard = true; use(JSON.parse(data)); });
  const open = () => {
    stream = new EventSource(`/api/v1/runs/${id}/events` + (tell.after ? `?after=${tell.after()}` : ""));
    on("run", tell.run);
    if (tell.question) on("question", tell.question);
    if (tell.metrics) on("metrics", ({ rows }) => tell.metrics(rows));
    stream.addEventListener("error", () => { heard = false; });
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
    stream?.close();
    stream = null;
    heard = false;
    if (!document.hidden) open();
    poll();
  };
  addEventListener("pagehide", () => stream?.close());
  document.addEventListener("visibilitychange", turn);
  turn();
}

async function get(path) {
  const reply = await fetch(path);
  if (!reply.ok) throw Object.assign(new Error(reply.statusText), { status: reply.status });
  return reply.json();
}
