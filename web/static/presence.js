// Presence: questions are held while somebody looks at this page, and are given back soon after they left it.
import { client, main, page, run } from "./page.js";
import { next, prefetch } from "./questions.js";

const RENEW = 25_000; // ms between renewals; a lease lasts a minute
const LAPSE = 20; // seconds without a sign of life after which the next one renews at once
const SETTLE = 2000; // ms; a request that leaves may be overtaken by one that renews: the second renewal is surely later
const AWAY = 1e6; // seconds: nobody looks at a page that is hidden
const LEFT = "parenting.left";
const SIGNS = ["pointermove", "pointerdown", "keydown", "wheel", "scroll", "focus", "touchstart"];
const attention = Number(main.dataset.attention);
let sign = performance.now(), holders = new Map();

const idle = () => (document.hidden ? AWAY : (performance.now() - sign) / 1000);
export const attentive = () => idle() < attention;

function post(verb, body) {
  return fetch(`/api/v1/runs/${run}/queries/${verb}`, {
    method: "POST", keepalive: true, headers: { "content-type": "application/json" }, body: JSON.stringify({ client_id: client, ...body }),
  });
}

// Hold what is on the page as long as somebody looks at it, and learn who has it.
export async function renew() {
  const { current, ahead } = page, shown = [current, ahead, ...page.later].filter(Boolean);
  if (!current || current.dataset.former) return; // an answered question that is being changed is nobody's to hold
  const reply = await post("renew", { questions: shown.map(({ dataset }) => dataset.query), idle: idle() }).catch(() => null);
  if (!reply?.ok) return;
  const { yours, elsewhere } = await reply.json();
  if (ahead && ahead === page.ahead && !yours.includes(ahead.dataset.query)) {
    page.ahead = page.later.shift() ?? null;
    current.dataset.ahead = page.ahead?.dataset.query ?? "";
    page.wish(true);
  }
  if (current !== page.current) return;
  if (yours.includes(current.dataset.query)) {
    if (!page.lookout) prefetch();
    return;
  }
  page.taken = elsewhere.includes(current.dataset.query);
  page.current = null;
  page.wish(true);
  page.player.still();
  next();
}

// The leases of the run that hold now. One that has ended may be had; one of this page may have been taken over.
export function leases(now) {
  const held = new Map(now.map(({ question, holder }) => [question, holder]));
  const freed = [...holders.keys()].some((question) => !held.has(question));
  holders = held;
  if (page.current?.dataset.former) return;
  if (page.current) {
    const shown = [page.current, page.ahead].filter(Boolean);
    if (shown.some(({ dataset }) => held.get(dataset.query) !== main.dataset.holder)) renew();
  } else if (freed) next();
}

// What this page holds is free for others in 5 s. Other tabs of this browser are told, which may show the same question.
export function leave() {
  post("leave").catch(() => null);
  try { localStorage.setItem(LEFT, `${run} ${Date.now()}`); } catch { /* no storage: then the stream tells them */ }
}

function signed() {
  const lapsed = idle() > LAPSE;
  sign = performance.now();
  if (!lapsed) return;
  renew();
  page.wish();
}

function back() {
  sign = performance.now();
  renew();
  setTimeout(renew, SETTLE);
}

for (const kind of SIGNS) addEventListener(kind, signed, { capture: true, passive: true });
addEventListener("pagehide", leave);
addEventListener("pageshow", back);
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) return back();
  page.lookout?.abort();
  leave();
});
addEventListener("storage", ({ key, newValue }) => {
  if (key === LEFT && newValue?.startsWith(run) && !document.hidden) back();
});
setInterval(renew, RENEW);
