// Keeps the place of the person while one question takes the place of another: where the focus is, and what is open.
import { stage } from "./page.js";

const PARTS = [".answers [value]", ".around summary", "[data-explore]", ".cannot", ".steps [data-step]", "[data-replay]", "[role=grid]"];
let place = null, open = false;

// A selector of the same part of another question; null for what has none there.
function placeOf(target) {
  const part = PARTS.find((one) => target.closest(one));
  if (part?.includes("[value]")) return `.answers [value=${target.value}]`;
  return part?.includes("[data-step]") ? `[data-step="${target.dataset.step}"]` : part ?? null;
}

addEventListener("focusin", ({ target }) => { place = stage.contains(target) ? placeOf(target) : null; });
stage.addEventListener("toggle", ({ target }) => { open = target.open; }, true);

// Move the focus into the board's grid, whose script comes when it is first used.
export function openGrid(form) {
  if (form.dataset.grid) import("./grid.js").then(({ explore }) => explore(form));
}

// Give a question that has just come what the one before it had.
export function restore(form) {
  for (const part of form.querySelectorAll("[data-explore]")) part.hidden = false;
  if (open) form.querySelector(".around").open = true;
  if (place === "[role=grid]") openGrid(form);
  else if (place) form.querySelector(place)?.focus({ preventScroll: true });
}
