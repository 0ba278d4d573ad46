// A question takes no answer before it has been on the screen long enough to be seen. What is typed or clicked before is
// not kept for later. `data-listening` on the form says that it takes one.
import { main, stage } from "./page.js";

const AFTER = Number(main.dataset.listenAfter); // ms after paint

export const listens = (form) => form !== null && "listening" in form.dataset;

function setListening(form, listening) {
  form.toggleAttribute("data-listening", listening);
  for (const button of form.querySelectorAll("button[name=choice]")) {
    if (listening) button.removeAttribute("aria-disabled");
    else button.setAttribute("aria-disabled", "true");
  }
}

export function arm(form) {
  setListening(form, AFTER === 0);
  if (!AFTER) return;
  const listen = () => { if (form.isConnected) setListening(form, true); };
  requestAnimationFrame(() => setTimeout(() => setTimeout(listen, AFTER))); // a page that nobody sees is not painted
}

// The second click of a double click does not answer the question that came in between.
let pressed = null;
stage.addEventListener("click", (event) => {
  const form = event.target.closest("form");
  if (event.detail > 1 && form !== pressed) {
    event.preventDefault();
    event.stopImmediatePropagation();
  } else pressed = form;
}, true);
