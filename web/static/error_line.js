// Faults of a page's own scripts: a line that people see, and a line in the server's log.
import { t } from "./sentences.js";

const MOST = 5; // faults that one page sends to the server
let told = 0;

const cut = (text, most) => (text ? String(text).slice(0, most) : null);

function line() {
  const known = document.getElementById("alert");
  if (known) return known;
  const made = document.createElement("p");
  made.className = "alert";
  made.setAttribute("role", "alert");
  document.getElementById("main").prepend(made);
  return made;
}

export function tell(message, { source, row, column, stack }) {
  line().textContent = t("Something on this page went wrong. Reload it; answers that were not stored yet are kept and sent.");
  const saved = document.getElementById("saved");
  if (saved?.textContent === "Saving") saved.textContent = t("Kept here, not sent yet");
  if (++told > MOST) return;
  const { run } = document.getElementById("main").dataset;
  const body = {
    message: cut(message, 500) ?? "unknown", source: cut(source, 300), line: row || null, column: column || null,
    stack: cut(stack, 4000), page: cut(location.pathname, 300), run: run ?? null,
  };
  fetch("/api/v1/page-errors", {
    method: "POST", keepalive: true, headers: { "content-type": "application/json" }, body: JSON.stringify(body),
  }).catch(() => null); // the line is on the page
}

