// The history: the boards of an answer play while they are pointed at or hold the focus, and stand still otherwise.
import "./errors.js";
import { forecasts } from "./forecast.js";
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

// Guidance on one board: the forecast of a move plays while its arrow is pointed at, or its button is pointed at or used.
function met(entry) {
  const { show } = forecasts(entry);
  for (const button of entry.querySelectorAll("button[data-choice]")) button.addEventListener("click", () => show(button.dataset.choice));
}

for (const entry of document.querySelectorAll("[data-play]")) {
  const outside = ({ relatedTarget }) => !entry.contains(relatedTarget);
  entry.querySelector(".steps").hidden = false;
  if (entry.querySelector(".scene")) {
    met(entry);
    continue;
  }
  entry.addEventListener("mouseenter", () => begin(entry));
  entry.addEventListener("mouseleave", () => { if (!entry.contains(document.activeElement)) end(entry); });
  entry.addEventListener("focusin", (event) => { if (outside(event)) begin(entry); });
  entry.addEventListener("focusout", (event) => { if (outside(event)) end(entry); });
}
