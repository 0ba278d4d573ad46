// What the parent's page does once its first question is painted: it takes keys and clicks, shows one question after
// another, and says who waits for whom.
import { answer, count, report } from "./answers.js";
import "./bell.js";
import "./keys.js";
import { carry } from "./carried.js";
import { poll } from "./live.js";
import { kept } from "./kept.js";
import { flush, flushAll } from "./outbox.js";
import { $, alarm, given, page, run, waiting } from "./page.js";
import { play } from "./play.js";
import { attentive, leases } from "./presence.js";
import { arrive, next, prefetch, show, take } from "./questions.js";
import { t } from "./sentences.js";
import { heed, relieve } from "./undo.js";
import { lostState, wait } from "./waiting.js";

const UNWALKED = t("The walk cannot be loaded now. Try again.");

// A part of the page that is loaded when it is first used, after the style sheet that such parts share.
let styled = null;
function later(load) {
  styled ??= new Promise((done, fail) => {
    const link = Object.assign(document.createElement("link"), { rel: "stylesheet", href: $("walk").dataset.sheet, onload: done, onerror: fail });
    document.head.append(link);
    link.addEventListener("error", () => { // the next use asks again
      link.remove();
      styled = null;
    });
  });
  return styled.then(load);
}

function clear() {
  page.player?.still();
  page.current = page.ahead = null;
  page.later = [];
}

// What the run's stream says.
const tell = {
  run(now) {
    if (["offline", "away", "refused"].includes(page.state)) flushAll(report);
    page.state = now.state;
    if (page.state !== "question") page.taken = false;
    page.goal = now.goal;
    if (now.reason) $("reason").textContent = now.reason;
    $("optimal").hidden = !now.optimal || !now.standing || page.state === "over";
    if ($("resume")) $("resume").hidden = !["stopped", "failed"].includes(now.status);
    count(now.answers, now.answers - now.standing);
    relieve();
    heed();
    if (now.answers && (given.size || !page.current)) later(() => import("./growth.js")).then(({ grown }) => grown(now, !page.current), () => null); // the next answer asks again
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
  asked: arrive,
  leases,
  lost(status) {
    page.state = lostState(status);
    if (page.state === "refused" && page.current) clear(); // what is answered now may never be sent
    wait(page.state);
  },
};

// What the page has of its run's questions, and whether somebody is there who answers more of them.
function has() {
  const forms = [page.current, page.ahead, ...page.later].filter(Boolean);
  return { shown: [...new Set([...forms.map(({ dataset }) => dataset.query), ...kept()])], asks: attentive() };
}

// Hear of the run by the browser's stream, and ask for it while nothing is heard.
function listen() {
  const { heard, wish } = carry((event, data) => tell[event](data), has);
  Object.assign(page, { carried: heard, wish });
  const ask = poll(run, tell, heard, true);
  document.addEventListener("visibilitychange", ask);
  ask();
}

// Answer what is on the stage, send what an earlier visit left behind, then follow the run.
export function begin(form) {
  page.answer = answer;
  import("./error_line.js").catch(() => null); // it is here when there is no connection
  addEventListener("pagehide", () => flush(report));
  waiting.addEventListener("submit", (event) => {
    if (!event.target.action.endsWith("/parent/take")) return;
    event.preventDefault();
    take();
  });
  // Watch it walk. The form works without this script; its style sheet comes with the walk, too.
  $("walk").addEventListener("submit", (event) => {
    event.preventDefault();
    later(() => import("./walk.js")).then(({ watch }) => {
      if ($("alert").textContent === UNWALKED) alarm("");
      watch(play);
    }, () => { alarm(UNWALKED); });
  });
  if (form) show(form);
  flush(report).then(listen);
}
