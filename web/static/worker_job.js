// A job that any worker does, and its result (docs/api.md, "Watching the policy").
const POLL = 100, SLOW = 500, SOON = 20; // ms between two looks: at first, and after so many looks
const GONE = "The server does not answer. Try again.";

export async function reply(path, options) {
  const found = await fetch(path, options).catch(() => { throw new Error(GONE); });
  if (!found.ok) throw new Error((await found.json().catch(() => null))?.error?.message ?? GONE);
  return found;
}

// Ask for a job and wait for it. `waits(worker)` is told whether a worker is alive; null where `wanted()` no longer holds.
export async function job(run, kind, payload, waits, wanted) {
  const body = JSON.stringify({ client_id: "dashboard", kind, payload });
  let asked = await (await reply(`/api/v1/runs/${run}/jobs`, { method: "POST", headers: { "content-type": "application/json" }, body })).json();
  for (let looks = 0; asked.state === "waiting" || asked.state === "working"; looks++) {
    if (!wanted()) return null;
    waits(asked.worker);
    await new Promise((rest) => { setTimeout(rest, looks < SOON ? POLL : SLOW); });
    asked = await (await reply(`/api/v1/jobs/${asked.id}`)).json();
  }
  if (asked.state === "failed") throw new Error(asked.reason);
  return asked;
}
