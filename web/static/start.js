// The level list shows the levels of the chosen world only. Without this script it shows all, by world.
const world = document.getElementById("world"), level = document.getElementById("level");

function narrow() {
  for (const group of level.querySelectorAll("optgroup")) group.hidden = group.disabled = group.dataset.world !== world.value;
  if (level.selectedOptions[0]?.parentElement.disabled) level.value = level.querySelector("optgroup:not([disabled]) option").value;
}

world.addEventListener("change", narrow);
narrow();
