// What the parts of the parent's page share: its elements, the names of run and client, and what stands on it now.
export const $ = (id) => document.getElementById(id);
export const main = $("main"), stage = $("stage"), waiting = $("waiting");
export const { run, client, name } = main.dataset;
export const given = new Set(); // questions that were answered on this page

export const page = {
  answer: null, // what a choice does: each page with questions sets its own
  current: null, // the form on the stage, until it is answered
  shown: 0, // when it came, by the page's clock
  seen: { at: 0, by: 0 }, // when it was painted, by the wall clock and by the page's
  player: null,
  put: null, // the form that was put on the stage last
  ahead: null, // the form after it
  later: [], // and those after that, where the stream brought more
  carried: () => false, // whether a stream brings what happens, and questions
  wish() {}, // tells the stream that this page has other questions than it knows
  lookout: null, // aborts the request for it
  asking: false, // a request for a question is under way
  again: false, // another one was wanted meanwhile
  taken: false, // somebody else took the last question over
  state: main.dataset.state,
  answers: Number($("count").dataset.standing) + Number(main.dataset.retracted), // as they are numbered
  retracted: Number(main.dataset.retracted), // of these, those that stand no more
  goal: Number($("goal").dataset.goal),
  opening: false, // a dialog is on its way, and no key answers
  quiet: 0, // the timer after which the page says that the agent explores
};

// A dialog has the keys.
export const inDialog = () => page.opening || document.querySelector("dialog[open]") !== null;

const CALM = 60; // ms

// What a screen reader is to say. The same words twice are said twice only if they were gone in between.
export function speak(words) {
  $("said").textContent = "";
  setTimeout(() => { $("said").textContent = words; }, CALM);
}

// Tell an error on the line above the question, and move the focus there.
export function alarm(words) {
  const line = $("alert");
  line.textContent = words;
  if (words) line.focus();
}

// Do something once the stage is painted: until then the page has nothing else to do.
export function painted(then, calm = CALM) {
  let timer = 0;
  const once = () => { clearTimeout(timer); then?.(); then = null; };
  requestAnimationFrame(() => setTimeout(once, calm));
  timer = setTimeout(once, 5 * CALM); // a hidden page is never painted
}
