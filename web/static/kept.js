// The answers that this browser keeps until the server has acknowledged them. Each is an item of its own, so that two tabs
// which keep and drop answers at the same time touch nothing of each other's.
import { given } from "./page.js";

export const ANSWERED = "parenting.answered"; // tells the other tabs of this browser of an answer that is stored
const EACH = "parenting.answer.", FORMER = "parenting.answers"; // up to version 0.10.5 one item held the list of all
const memory = new Map(); // answers that the storage has no room for, by their keys, while the page lives
export const elsewhere = new Set(); // answers that the server at this address would not have, until it was away

// One key for an answer. Version 0.1 named no database, and its questions by number: such an answer is kept, not sent.
export const key = ({ database, question, query }) => `${database} ${question ?? query}`;
export const meant = (answer) => !elsewhere.has(key(answer));
const turn = (answer) => answer.after ?? answer.given ?? 0;

// An answer may have been changed while it was on its way.
const same = (answer) => (other) => key(other) === key(answer) && other.given === answer.given;

function stored(name) {
  try { return JSON.parse(localStorage.getItem(name)); } catch { return null; }
}

function names() {
  try { return Object.keys(localStorage).filter((name) => name.startsWith(EACH)); } catch { return []; }
}

// All of them, in the order in which they are sent.
export function read() {
  const found = [stored(FORMER), ...names().map(stored)].flat().filter(Boolean);
  return [...new Map([...found, ...memory.values()].map((answer) => [key(answer), answer])).values()].sort((one, other) => turn(one) - turn(other));
}

// Whether an answer is kept still: another tab may have sent it.
export const holds = (answer) => read().some(same(answer));

// Keep an answer, in place of an earlier one to its question.
export function keep(answer) {
  memory.set(key(answer), answer);
  try {
    localStorage.setItem(EACH + key(answer), JSON.stringify(answer));
    memory.delete(key(answer));
  } catch { /* no storage, or no room: memory holds it */ }
}

// The others are to be sent before this one.
export function defer(answer) {
  if (holds(answer)) keep({ ...answer, after: Date.now() });
}

// The server has acknowledged an answer.
export function drop(answer) {
  if (!holds(answer)) return;
  memory.delete(key(answer));
  try {
    localStorage.removeItem(EACH + key(answer));
    const former = stored(FORMER);
    if (former) localStorage.setItem(FORMER, JSON.stringify(former.filter((other) => key(other) !== key(answer))));
  } catch { /* no storage: memory held it */ }
}

// The questions whose answers are still on their way to this server.
export const kept = () => read().filter((answer) => answer.question && meant(answer)).map(({ question }) => question);

// Whether an answer of this page is among them.
export const unsaved = () => kept().some((question) => given.has(question));
