// Pre-training before a run: the job is looked at each second, and the form goes on once it is over.
import "./errors.js";
import { lost } from "./lost.js";
import { number } from "./numbers.js";

const form = document.querySelector("[data-job]"), told = document.getElementById("told"), bar = document.getElementById("progress");
const { job } = form.dataset;
let sent = false; // the form was sent, to cancel for example: what is heard of the job now must not send it again

// Steps done of all, and the time left by the pace so far; how many there will be is known only once it has converged.
function progressed({ steps, expected, seconds }) {
  bar.value = Math.min(steps / expected, .99);
  const left = Math.ceil((expected - steps) * seconds / steps / 5) * 5;
  const time = left > 90 ? `about ${Math.round(left / 60)} min left` : left > 0 ? `about ${left} s left` : "it takes longer than most";
  return `${number(steps)} of about ${number(expected)} steps, ${time}.`;
}

async function look() {
  const reply = await fetch(`/api/v1/jobs/${job}`).catch(() => null);
  const found = reply?.ok ? await reply.json() : null;
  if (sent) return;
  if (reply?.status === 404 || found?.state === "done" || found?.state === "failed") return form.requestSubmit(form.querySelector("button"));
  told.textContent = !found ? lost(reply) : found.worker === "silent" ? "No worker is running. It begins once one is started (parenting worker)." : found.state === "waiting" ? "It waits for a worker." : found.progress ? progressed(found.progress) : "A worker is at it.";
  setTimeout(look, 1000);
}

form.addEventListener("submit", () => { sent = true; });
addEventListener("pageshow", ({ persisted }) => {
  if (persisted && sent) { sent = false; look(); }
});
if (job) setTimeout(look, 1000);
