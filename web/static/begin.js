// Begins a question that is on the stage: it is told to screen readers, takes an answer soon, and its boards can play.
import { arm } from "./arming.js";
import { turn } from "./compare.js";
import { forecasts } from "./forecast.js";
import { $, page } from "./page.js";
import { restore } from "./place.js";
import { play } from "./play.js";

// A cell has 16 px at least; what does not fit then is scrolled to, and the agent is in sight.
function size(form) {
  for (const board of form.querySelectorAll(".board")) {
    const { width, height } = board.viewBox.baseVal;
    board.style.setProperty("--wide", width / 20);
    board.style.setProperty("--high", height / 20);
  }
  for (const part of form.querySelectorAll(".scene, .card")) {
    if (part.scrollWidth <= part.clientWidth) continue;
    const agent = part.querySelector(".agent").getBoundingClientRect(), { left, width } = part.getBoundingClientRect();
    part.scrollLeft += agent.left + agent.width / 2 - left - width / 2;
  }
}

export function begin(form) {
  const one = form.matches(".one");
  if (!one) form.dataset.side = "left";
  size(form);
  page.current = form;
  arm(form);
  $("said").textContent = form.dataset.spoken;
  page.player = one ? forecasts(form) : play(form, () => turn(form));
  restore(form);
}
