// The form shows the levels, glyphs and settings of the chosen world only. Without this script it shows all, by world.
import "./errors.js";
import { following } from "./runs_live.js";

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

// What is cut from a level of one's own, or the first rule that it breaks, while it is typed.
const WAIT = 400; // ms without a change
const told = document.getElementById("level_text-told");
let timer, asked = 0;

async function check() {
  const mine = ++asked, text = own.value;
  const options = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ world: world.value, text }) };
  const reply = text.trim() ? await fetch("/api/v1/levels/check", options).catch(() => null) : null;
  const found = reply?.ok ? await reply.json() : { said: [], error: null };
  if (mine !== asked) return;
  const lines = [...found.said.map((said) => [`${said[0].toUpperCase()}${said.slice(1)}.`, "hint"]), ...(found.cost ? [[found.cost, "hint"]] : []), ...(found.error ? [[found.error.message, "error"]] : [])];
  told.replaceChildren(...lines.map(([textContent, className]) => Object.assign(document.createElement("p"), { textContent, className })));
}

function soon() {
  clearTimeout(timer);
  timer = setTimeout(check, WAIT);
}

// Another world offers its own preset, unless a person chose one.
const offered = () => world.selectedOptions[0].dataset.preset;
let before = offered();

function offer() {
  const chosen = document.querySelector("input[name=preset]:checked");
  if (chosen?.value === before) document.querySelector(`input[name=preset][value="${offered()}"]`).checked = true;
  before = offered();
}

// A policy's file is sent as soon as it is chosen.
const file = document.getElementById("policy_file");
file.addEventListener("change", () => file.files.length && file.form.requestSubmit(document.querySelector("[formaction='/policies']")));

own.addEventListener("input", soon);
world.addEventListener("change", () => { narrow(); offer(); soon(); });
narrow();
following();
