// A page that follows the server: now and then it asks for itself, and takes over what has changed.
import { lost } from "./lost.js";

const SHARE = 10; // a look, and the drawing after it, take a tenth of the time at most

// The page as the server has it by now; null, and why on the line `said`, where the server does not send it.
export async function fetched(address, said) {
  const reply = await fetch(address).catch(() => null);
  if (!reply?.ok) said.textContent = lost(reply);
  return reply?.ok ? new DOMParser().parseFromString(await reply.text(), "text/html") : null;
}

// Looks again and again, `every` so many ms, while the page is seen and `lives()` holds.
export function follow(look, lives, every) {
  let timer = 0, busy = false;

  async function turn() {
    timer = 0;
    if (busy || document.hidden || !lives()) return;
    busy = true;
    const began = performance.now();
    try {
      await look();
    } finally {
      busy = false;
      timer = setTimeout(turn, Math.max(every, SHARE * (performance.now() - began)));
    }
  }

  document.addEventListener("visibilitychange", () => { if (!timer) turn(); });
  timer = setTimeout(turn, every);
}
