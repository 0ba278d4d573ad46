// Pre-training before a run: the job is looked at each second, and the form goes on once it is over.
import "./errors.js";

const form = document.querySelector("[data-job]"), told = document.getElementById("told"), began = Date.now();
const { job } = form.dataset;

async function look() {
  const reply = await fetch(`/api/v1/jobs/${job}`).catch(() => null);
  const found = reply?.ok ? await reply.json() : null;
  if (reply?.status === 404 || found?.state === "done" || found?.state === "failed") return form.requestSubmit(form.querySelector("button"));
  const passed = Math.round((Date.now() - began) / 1000);
  told.textContent = !found ? "The server does not answer." : found.worker === "silent" ? "No worker is running. It begins once one is started (parenting worker)." : found.state === "waiting" ? "It waits for a worker." : `A worker is at it; you have waited for ${passed} s.`;
  setTimeout(look, 1000);
}

if (job) setTimeout(look, 1000);
