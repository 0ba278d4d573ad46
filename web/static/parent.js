// The parent's page. First it paints its question; all that answers it comes after that.
import "./errors.js";
import { ask, put } from "./asking.js";
import { kept } from "./kept.js";
import { page, painted, run, stage } from "./page.js";

const AGAIN = 1000; // ms until a script that did not arrive is asked for again; meanwhile the form answers by itself

async function first() {
  const there = stage.querySelector("#question");
  if (there) return kept().includes(there.dataset.query) ? null : there;
  return page.state === "question" ? ask().catch(() => null) : null;
}

function attend(form) {
  import("./answering.js").then(({ begin }) => begin(form), (error) => {
    reportError(error);
    setTimeout(attend, AGAIN, form);
  });
}

history.replaceState(null, "", `/runs/${run}/parent`);
first().then((form) => {
  if (form) put(form);
  painted(() => attend(form), 0);
});
