// Tells a parent who waits or looks elsewhere that the agent needs help, by a sound and a notification. Off until a button
// turns it on. What makes the sound is loaded when it is first wanted.
import { name, page, waiting } from "./page.js";
import { t } from "./sentences.js";

const KEY = "parenting.bell"; // "on" in the browser's storage
const LONG = 5000; // ms of waiting after which a question is told of although the page is seen
const buttons = [];
let since = performance.now();
let on = read();

function read() {
  try { return localStorage.getItem(KEY) === "on"; } catch { return false; }
}

function show() {
  for (const button of buttons) {
    button.hidden = false;
    button.setAttribute("aria-pressed", on);
  }
}

async function toggle() {
  on = !on;
  try { localStorage.setItem(KEY, on ? "on" : "off"); } catch { /* a browser that keeps nothing keeps this for the page's life */ }
  show();
  if (on) (await import("./sound.js")).begin();
}

// A button that turns it on and off.
page.bell = (button) => {
  buttons.push(button);
  button.addEventListener("click", toggle);
  show();
};
document.querySelectorAll(".bell").forEach(page.bell);
new MutationObserver(() => {
  if (!waiting.hidden) since = performance.now();
  else if (on && (document.hidden || performance.now() - since > LONG)) {
    import("./sound.js").then(({ ring }) => ring(`${t("The agent needs you")} · ${name}`), () => null); // not without the server
  }
}).observe(waiting, { attributeFilter: ["hidden"] });
