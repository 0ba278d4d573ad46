// Keys and clicks.
import { answer } from "./answers.js";
import { $, help, page, stage } from "./page.js";

const KEYS = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "either", ArrowDown: "neither", 1: "left", 2: "right", 3: "either", 4: "neither" };

stage.addEventListener("submit", (event) => {
  event.preventDefault();
  answer(event.submitter.value);
});

addEventListener("keydown", (event) => {
  const { key, target } = event;
  if (event.repeat && target.closest?.("#stage")) event.preventDefault(); // a key held down presses no button twice
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || event.isComposing || help.open) return;
  if (target.closest("input, textarea, select, [contenteditable]")) return;
  if (key === "?") help.showModal();
  else if (key === " " && !target.closest("button, a, summary")) page.player?.replay();
  else if (KEYS[key] && !event.shiftKey && page.current) answer(KEYS[key]);
  else return;
  event.preventDefault();
});

$("help-open").hidden = false;
$("help-open").addEventListener("click", () => help.showModal());
