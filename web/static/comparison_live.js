// Runs that go on: the tables stay the server's, and one request tells which curves have grown.
import { fetched, follow } from "./following.js";

const EVERY = 2000; // ms between two looks
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

  async function look() {
    const page = await fetched(location.href, said);
    if (!page) return;
    const mine = of(document), fresh = of(page);
    if (mine.map(name).join() !== fresh.map(name).join()) return location.reload(); // a filter leaves others by now
    const gone = mine.filter(({ dataset }, at) => dataset.run && (dataset.tick !== fresh[at].dataset.tick || "living" in dataset !== "living" in fresh[at].dataset));
    const numbers = gone.map(({ dataset }) => dataset.run);
    mine.forEach((row, at) => update(row, fresh[at]));
    said.textContent = page.getElementById("living").textContent;
    if (numbers.length) await moved(numbers);
  }

  follow(look, lives, EVERY);
}
