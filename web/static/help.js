// Help: the dialog of all keys, fetched when it is first asked for.
import { letters } from "./keys.js";
import { $, page } from "./page.js";

let dialog = null;

async function fetched() {
  const reply = await fetch("/help");
  if (!reply.ok) throw new Error(reply.statusText);
  document.body.insertAdjacentHTML("beforeend", await reply.text());
  const allow = $("letters");
  allow.checked = letters.on;
  allow.addEventListener("change", () => { letters.on = allow.checked; });
  for (const button of $("help").querySelectorAll(".bell")) page.bell?.(button);
  return $("help");
}

export async function help() {
  dialog ??= await fetched();
  dialog.showModal();
}
