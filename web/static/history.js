// The history: the boards of an answer play while they are pointed at or hold the focus, and stand still otherwise.
import { play } from "./play.js";

const players = new Map();
const calm = matchMedia("(prefers-reduced-motion: reduce)"); // then nothing moves unless a button says so

function begin(entry) {
  if (!players.has(entry)) players.set(entry, play(entry));
  if (!calm.matches) players.get(entry).replay();
}

function end(entry) {
  for (const part of entry.getAnimations({ subtree: true })) part.cancel();
}

for (const entry of document.querySelectorAll("[data-play]")) {
  const outside = ({ relatedTarget }) => !entry.contains(relatedTarget);
  entry.querySelector(".steps").hidden = false;
  entry.addEventListener("mouseenter", () => begin(entry));
  entry.addEventListener("mouseleave", () => { if (!entry.contains(document.activeElement)) end(entry); });
  entry.addEventListener("focusin", (event) => { if (outside(event)) begin(entry); });
  entry.addEventListener("focusout", (event) => { if (outside(event)) end(entry); });
}
