// What the page measures of an answer: when its question was seen, the first reaction to it, and how it was given.
// Spans are of the monotonic clock, moments of the wall clock. What cannot be measured is null.
import { takesTurns } from "./compare.js";
import { page, stage } from "./page.js";

const LONGEST = 1e10, LATEST = 253_402_300_799_999, WIDEST = 100_000; // what the server takes (server/measures.py)
const MODIFIERS = ["Shift", "Control", "Alt", "Meta", "CapsLock", "AltGraph"];
let asked = null, reacted = null, means = null, left = null, absences = [];

const whole = (number, most = LONGEST) => (number >= 0 && number <= most ? Math.round(number) : null);

// Another question begins with nothing.
function begin() {
  if (asked === page.put) return;
  asked = page.put;
  reacted = means = null;
  absences = [];
  left = document.hidden ? performance.now() : null;
}

function react(how) {
  begin();
  reacted ??= performance.now();
  means = how ?? means;
}

function away(now) {
  const gone = left === null ? absences : [...absences, [left, now]];
  const spans = gone.map(([from, until]) => until - Math.max(from, page.seen.by)).filter((span) => span > 0);
  return Math.ceil(spans.reduce((sum, span) => sum + span, 0));
}

// The candidates as they stand on the screen, from the left or from the top.
function sides(form) {
  const [one, other] = ["left", "right"].map((side) => form.querySelector(`.card[value=${side}], .moves [value=${side}]`));
  if (!one || !other) return null;
  const [a, b] = [one, other].map((part) => part.getBoundingClientRect());
  if (!a.width || !b.width) return one.compareDocumentPosition(other) & Node.DOCUMENT_POSITION_FOLLOWING ? "left-right" : "right-left";
  const stacked = a.bottom <= b.top || b.bottom <= a.top;
  return (stacked ? a.top < b.top : a.left < b.left) ? "left-right" : "right-left";
}

// The measures of the answer that is given now.
export function measure(form) {
  begin();
  const now = performance.now(), { at, by } = page.seen;
  return {
    shown: whole(at, LATEST),
    reacted: reacted === null ? null : whole(Math.max(0, reacted - by)),
    answered: whole(now - by),
    away: whole(away(now)),
    layout: form.matches(".one") ? "one" : takesTurns(form) ? "turns" : "two",
    sides: sides(form),
    width: whole(innerWidth, WIDEST),
    height: whole(innerHeight, WIDEST),
    input: means,
    wording: form.dataset.wording ?? null,
  };
}

// The same as it is sent, perhaps long after the answer was given.
export const sent = (measured, given) => measured && { ...measured, queued: whole(Date.now() - given) };

addEventListener("keydown", ({ key }) => { if (!MODIFIERS.includes(key)) react("key"); }, { capture: true, passive: true });
stage.addEventListener("pointerdown", ({ pointerType }) => react(pointerType === "mouse" ? "click" : "touch"), { capture: true, passive: true });
stage.addEventListener("pointermove", ({ movementX, movementY }) => { if (movementX || movementY) react(); }, { capture: true, passive: true });
document.addEventListener("visibilitychange", () => {
  begin();
  if (document.hidden) left = performance.now();
  else if (left !== null) {
    absences.push([left, performance.now()]);
    left = null;
  }
});
