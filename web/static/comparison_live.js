// Runs that go on: now and then the page asks the server for itself, and takes over the numbers that have changed. So the
// tables stay the server's, and one request tells which curves have grown.
const EVERY = 2000, SHARE = 10; // ms between two looks; a look and the drawing after it take a tenth of the time at most
const ROWS = "tr[data-group]";
const of = (page) => [...page.querySelectorAll(ROWS)];
const name = ({ dataset: { run, group } }) => `${run ?? ""} ${group}`;
const lives = () => of(document).some(({ dataset }) => "living" in dataset);

// Takes over what differs, cell by cell: whoever reads a table or has the focus in it stays there.
function update(row, fresh) {
  [...row.cells].forEach((cell, at) => { if (cell.innerHTML !== fresh.cells[at].innerHTML) cell.innerHTML = fresh.cells[at].innerHTML; });
  row.toggleAttribute("data-living", "living" in fresh.dataset);
  row.dataset.tick = fresh.dataset.tick ?? "";
}

// Calls `moved(numbers)` with the runs that have gone on, waits until it has settled, and goes on until all runs are over.
export function following(moved) {
  const said = document.getElementById("living");
  let timer = 0, busy = false;

  async function fetched() {
    const reply = await fetch(location.href).catch(() => null);
    return reply?.ok ? new DOMParser().parseFromString(await reply.text(), "text/html") : null;
  }

  async function look() {
    const page = await fetched();
    if (!page) return void (said.textContent = "No connection to the server. These numbers are of a moment ago.");
    const mine = of(document), fresh = of(page);
    if (mine.map(name).join() !== fresh.map(name).join()) return location.reload(); // a filter leaves others by now
    const gone = mine.filter(({ dataset }, at) => dataset.run && (dataset.tick !== fresh[at].dataset.tick || "living" in dataset !== "living" in fresh[at].dataset));
    const numbers = gone.map(({ dataset }) => dataset.run);
    mine.forEach((row, at) => update(row, fresh[at]));
    said.textContent = page.getElementById("living").textContent;
    if (numbers.length) await moved(numbers);
  }

  async function turn() {
    timer = 0;
    if (busy || document.hidden || !lives()) return;
    busy = true;
    const began = performance.now();
    try {
      await look();
    } finally {
      busy = false;
      timer = setTimeout(turn, Math.max(EVERY, SHARE * (performance.now() - began)));
    }
  }

  document.addEventListener("visibilitychange", () => { if (!timer) turn(); });
  timer = setTimeout(turn, EVERY);
}
