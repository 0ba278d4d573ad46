// Keys and clicks. Letters are those that are printed on the keys; by position only where a layout has no Latin letter there.
import { takesTurns, turn } from "./compare.js";
import { keyName } from "./key_names.js";
import { openGrid } from "./place.js";
import { $, inDialog, page, speak, stage } from "./page.js";
import { t } from "./sentences.js";

const CHOICES = { a: "left", b: "right", e: "either", n: "neither", s: "skip", 1: "left", 2: "right" };
const LETTERS = "parenting.letters"; // "off" in the browser's storage: single letters and digits answer nothing

// The choice that a key makes on a question; undefined if it makes none. Arrows are those of the moves, or of the sides.
export function choiceOf(name, form) {
  const way = /^Arrow(Up|Down|Left|Right)$/.exec(name)?.[1].toLowerCase();
  if (!way) return CHOICES[name];
  const named = [...form.querySelectorAll("[data-way]")].filter((button) => button.dataset.way === way);
  return named.length === 1 ? named[0].value : undefined;
}

export const letters = {
  get on() { try { return localStorage.getItem(LETTERS) !== "off"; } catch { return true; } },
  set on(on) { try { localStorage.setItem(LETTERS, on ? "on" : "off"); } catch { /* a browser that keeps nothing keeps this neither */ } },
};

stage.addEventListener("submit", (event) => {
  const turns = event.submitter.matches(".card") && takesTurns(page.current);
  if (!turns && event.target.matches("[data-plain]")) return; // the form itself is sent
  event.preventDefault();
  if (turns) turn(page.current);
  else page.answer(event.submitter.value);
});
stage.addEventListener("click", (event) => {
  if (event.target.closest("[data-explore]") && page.current) return openGrid(page.current);
  const part = event.target.closest("[data-choice]");
  if (part && page.current) page.answer(part.dataset.choice);
});

addEventListener("keydown", (event) => {
  const { target } = event, name = keyName(event);
  if (event.repeat && target.closest?.("#stage") && (name === "Enter" || name === " ")) event.preventDefault(); // a key held down presses no button twice
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || event.isComposing || inDialog()) return;
  if (target.closest("input:not([type=checkbox]), textarea, select, [contenteditable]")) return;
  if (name.length === 1 && name !== " " && !letters.on) return;
  if (name === "?") openHelp();
  else if (name === "d" && page.current && !event.shiftKey) speak(page.current.querySelector(".around ul").textContent.replace(/\s+/g, " ").trim());
  else if (name === "g" && page.current && !event.shiftKey) openGrid(page.current);
  else if (name === " " && page.player?.replay && !target.closest("button, a, summary, input")) page.player.replay();
  else if (name === "w" && !event.shiftKey) $("walk")?.requestSubmit(); // practice has no policy that walks
  else if (name === "o" && takesTurns(page.current)) turn(page.current);
  else {
    const shifted = event.shiftKey && !/^[12]$/.test(name); // digits are shifted on a French keyboard
    const choice = page.current && !shifted && choiceOf(name, page.current);
    if (!choice || (choice === "skip" && !page.current.querySelector(".cannot"))) return;
    page.answer(choice);
  }
  event.preventDefault();
});

async function openHelp() {
  if (inDialog()) return;
  page.opening = true;
  try {
    const { help } = await import("./help.js");
    await help();
  } catch {
    speak(t("The help did not come: there is no connection to the server."));
  } finally { page.opening = false; }
}
$("help-open").hidden = false;
$("help-open").addEventListener("click", openHelp);
