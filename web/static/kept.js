// The answers that this browser keeps until the server has acknowledged them.
const KEY = "parenting.answers";
let memory = [];
export const elsewhere = new Set(); // answers that the server at this address would not have, until it was away

export function read() {
  try { return JSON.parse(localStorage.getItem(KEY)) ?? memory; } catch { return memory; }
}

export function write(answers) {
  memory = answers;
  try { localStorage.setItem(KEY, JSON.stringify(answers)); } catch { /* no storage: memory holds them while the page lives */ }
}

// One key for an answer. Version 0.1 named no database, and its questions by number: such an answer is kept, not sent.
export const key = ({ database, question, query }) => `${database} ${question ?? query}`;
export const meant = (answer) => !elsewhere.has(key(answer));

// The questions whose answers are still on their way to this server.
export const kept = () => read().filter((answer) => answer.question && meant(answer)).map(({ question }) => question);
