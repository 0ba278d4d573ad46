// How long the rest of a goal will take: by the median time between this browser's last answers.
import { t } from "./sentences.js";

const KEY = "parenting.times", LAST = 20, FEW = 3;
let times = read(), before = 0;

function read() {
  try { return JSON.parse(localStorage.getItem(KEY)) ?? []; } catch { return []; }
}

addEventListener("pagehide", () => {
  try { localStorage.setItem(KEY, JSON.stringify(times)); } catch { /* no storage: the next visit starts without times */ }
});

// An answer was given just now.
export function recordAnswer() {
  const now = performance.now();
  if (before) times = [...times, now - before].slice(-LAST);
  before = now;
}

// The time that so many more answers will take, in words; "" while too few were given to tell.
export function timeLeft(answers) {
  if (times.length < FEW || answers <= 0) return "";
  const seconds = [...times].sort((a, b) => a - b)[times.length >> 1] * answers / 1000;
  return seconds < 5400 ? t("about {count} min", { count: Math.max(1, Math.round(seconds / 60)) }) : t("about {count} h", { count: Math.round(seconds / 3600) });
}
