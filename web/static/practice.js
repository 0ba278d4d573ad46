// Practice: the keys, clicks and boards of the parent's page. No run takes the answer, so the form itself is sent, and the
// server's next page says what the answer means.
import "./errors.js";
import { listens } from "./arming.js";
import { begin } from "./begin.js";
import { keyName } from "./key_names.js";
import { letters } from "./keys.js";
import { $, inDialog, page, stage } from "./page.js";

const question = $("question"), undo = $("undo");
let sent = false;

page.answer = (choice) => question.requestSubmit(question.querySelector(`.answers [value=${choice}]`));
// One act answers once: what comes too early, or a second time, is not sent.
stage.addEventListener("submit", (event) => {
  if (event.defaultPrevented) return; // another clip was shown
  if (sent || !listens(question)) event.preventDefault();
  else sent = true;
});
addEventListener("pageshow", () => { sent = false; }); // also when one comes back to the page
addEventListener("keydown", (event) => {
  if (keyName(event) !== "z" || !letters.on || undo.hidden || event.repeat || event.isComposing || inDialog()) return;
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, textarea, select, [contenteditable]")) return;
  undo.requestSubmit();
});
begin(question);
