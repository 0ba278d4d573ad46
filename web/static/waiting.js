// Says who waits for whom while no question is on the stage.
import { settle } from "./answers.js";
import { $, main, name, page, stage, waiting } from "./page.js";

// The state of a page whose request was refused: it has lost its right, or its run, or the server.
export const lostState = (status) => (status === 404 ? "away" : [401, 403].includes(status) ? "refused" : "offline");

const QUIET = 350; // ms that an answered question stays before the page says that the agent explores

export function wait(which) {
  if (page.current) return;
  main.dataset.state = which;
  for (const part of waiting.querySelectorAll(":scope > [data-state]")) part.hidden = part.dataset.state !== which;
  waiting.setAttribute("aria-labelledby", `waiting-${which}`);
  if (!waiting.hidden) return announce(which);
  page.quiet ||= setTimeout(() => {
    page.quiet = 0;
    settle();
    if (page.current) return;
    stage.replaceChildren();
    waiting.hidden = false;
    announce(main.dataset.state);
  }, stage.childElementCount ? QUIET : 0);
}

function announce(which) {
  const words = $(`waiting-${which}`).textContent;
  document.title = `${words} · ${name}`;
  if ($("said").textContent !== words) $("said").textContent = words;
}
