// The form shows the levels, glyphs and settings of the chosen world only. Without this script it shows all, by world.
import "./errors.js";

const world = document.getElementById("world"), level = document.getElementById("level"), own = document.getElementById("level_text");

function narrow() {
  for (const group of level.querySelectorAll("optgroup")) group.hidden = group.disabled = group.dataset.world !== world.value;
  if (level.selectedOptions[0]?.parentElement.disabled) level.value = level.querySelector("optgroup:not([disabled]) option").value;
  for (const hint of document.querySelectorAll(".hint [data-world]")) hint.hidden = hint.dataset.world !== world.value;
  for (const part of document.querySelectorAll("[data-worlds]")) {
    part.hidden = !part.dataset.worlds.split(" ").includes(world.value);
    part.querySelector("select").disabled = part.hidden; // what does not show is not sent
  }
  own.placeholder = document.querySelector(`.hint [data-world="${world.value}"]`).dataset.level;
}

world.addEventListener("change", narrow);
narrow();
