// Begins a question that is on the stage: it is told to screen readers, takes an answer soon, and its boards can play.
import { arm } from "./arming.js";
import { turn } from "./compare.js";
import { forecasts } from "./forecast.js";
import { $, page } from "./page.js";
import { restore } from "./place.js";
import { play } from "./play.js";
import { size } from "./size.js";

export function begin(form) {
  const one = form.matches(".one");
  if (!one) form.dataset.side = "left";
  page.current = form;
  page.shown = performance.now();
  arm(form);
  if (page.put !== form) {
    size(form);
    $("said").textContent = form.dataset.spoken;
  }
  page.player = one ? forecasts(form) : play(form, () => turn(form));
  restore(form);
}
