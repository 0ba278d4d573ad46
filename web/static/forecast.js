// Forecasts of guidance on one board: each plays while its arrow or its button is pointed at, focused or held.
import { play } from "./play.js";

const HOLD = 400; // ms of a touch that asks for the forecast and answers nothing

export function forecasts(question) {
  const scene = question.querySelector(".scene"), players = {};
  let shown = null, began = 0;
  const show = (side) => {
    if (side === shown) return;
    if (shown) players[shown].still();
    shown = side;
    for (const part of scene.querySelectorAll(".forecast")) part.classList.toggle("played", part.dataset.side === side);
    scene.classList.toggle("playing", !!side);
    if (side) (players[side] ??= play(scene.querySelector(`.forecast[data-side=${side}]`))).replay();
  };
  const sideOf = (target) => target.closest?.("[data-choice]")?.dataset.choice ?? target.closest?.("[data-way]")?.value ?? null;
  question.addEventListener("pointermove", ({ target, pointerType }) => { if (pointerType === "mouse") show(sideOf(target)); });
  question.addEventListener("pointerleave", () => show(null));
  question.addEventListener("pointerdown", ({ target, pointerType }) => {
    began = pointerType === "mouse" ? 0 : performance.now();
    if (began && sideOf(target)) setTimeout(() => { if (began) show(sideOf(target)); }, HOLD);
  });
  for (const end of ["pointerup", "pointercancel"]) question.addEventListener(end, () => { held = began && performance.now() - began > HOLD; began = 0; if (held) show(null); });
  let held = false;
  question.addEventListener("click", (event) => { if (held && event.detail) { event.preventDefault(); event.stopPropagation(); } held = false; }, true);
  question.addEventListener("contextmenu", (event) => { if (began && sideOf(event.target)) event.preventDefault(); });
  question.addEventListener("focusin", ({ target }) => { if (target.matches(":focus-visible")) show(sideOf(target)); });
  question.addEventListener("focusout", () => show(null));
  return { replay: null, still: () => show(null), show, get replays() { return Object.values(players).reduce((sum, one) => sum + one.replays, 0); } };
}
