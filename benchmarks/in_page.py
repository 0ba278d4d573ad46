"""Scripts that run in the page while `benchmarks/answers.py` measures it."""

PROBE = """(() => {
  const rows = window.rows = [];
  let key = 0;
  addEventListener("keydown", (event) => { key = event.timeStamp; }, true);
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) {
      const row = rows.find(({ query }) => query === entry.identifier);
      if (row) row.screen = entry.renderTime - row.key;
    }
  }).observe({ type: "element" });
  window.shown = (query, heading) => {
    const row = { query, key };
    rows.push(row);
    heading.setAttribute("elementtiming", query);
    requestAnimationFrame(() => {
      const { port1, port2 } = new MessageChannel();
      port1.onmessage = () => { row.painted = performance.now() - row.key; };
      port2.postMessage(0);
    });
  };
  addEventListener("DOMContentLoaded", () => {
    const stage = document.getElementById("stage");
    if (stage) new MutationObserver(() => {
      const form = stage.querySelector("#question"), query = form?.dataset.query;
      if (form && query !== rows.at(-1)?.query) shown(query, form.querySelector("h1"));
    }).observe(stage, { childList: true });
  });
})();"""
"""In the page: when a question was painted and was on the screen, after the last key."""

AHEAD = "document.querySelector('#question')?.dataset.ahead"
STARTED = """addEventListener("submit", () => {
  sessionStorage.setItem("began", performance.timeOrigin + performance.now());
}, true);"""
SINCE = """() => [rows[0].painted, rows[0].screen].map(
  (ms) => performance.timeOrigin + ms - sessionStorage.getItem("began"))"""
DONE = "at => rows[at]?.screen !== undefined && rows[at].painted !== undefined"
EMPTY = """addEventListener("keydown", () => {
  const heading = document.createElement("h1");
  heading.textContent = "A";
  document.body.replaceChildren(heading);
  shown(String(performance.now()), heading);
});"""
