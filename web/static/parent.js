// The parent's page: shows one question after another, takes keys and clicks, and says who waits for whom.
import { answer, count, report } from "./answers.js";
import "./bell.js";
import "./keys.js";
import { follow } from "./live.js";
import { flush, flushAll, kept } from "./outbox.js";
import { $, page, run, stage, waiting } from "./page.js";
import { leases } from "./presence.js";
import { next, prefetch, show, take } from "./questions.js";
import { wait } from "./waiting.js";

// What the run's stream says.
const tell = {
  run(now) {
    if (page.state === "offline" || page.state === "away") flushAll(report);
    page.state = now.state;
    if (page.state !== "question") page.taken = false;
    page.goal = now.goal;
    if (now.reason) $("reason").textContent = now.reason;
    $("optimal").hidden = !now.optimal || !now.answers || page.state === "over";
    $("resume").hidden = !["stopped", "failed"].includes(now.status);
    count(now.answers, now.answers - now.standing);
    if (page.current && page.state === "over") page.current = null;
    if (page.current) {
      if (!page.ahead && !page.lookout && now.open.guidance + now.open.preference > 1) prefetch();
      return;
    }
    if (page.state === "question") next();
    else wait(page.state);
  },
  question(asked) {
    if (!asked) return;
    if (!page.current) next();
    else if (asked.kind === "guidance" && asked.public_id !== page.current.dataset.query && !page.lookout) prefetch(); // it goes first
  },
  leases,
  lost(status) {
    page.state = status === 404 ? "away" : "offline";
    wait(page.state);
  },
};

// Send what an earlier visit left behind, then follow the run.
page.answer = answer;
addEventListener("pagehide", () => flush(report));
waiting.addEventListener("submit", (event) => {
  if (!event.target.action.endsWith("/parent/take")) return;
  event.preventDefault();
  take();
});
history.replaceState(null, "", `/runs/${run}/parent`);
const first = stage.querySelector("#question");
if (first && !kept().includes(first.dataset.query)) show(first);
flush(report).then(() => follow(run, tell, { background: true }));
