// The list of runs follows the runs on it.
import { fetched, follow } from "./following.js";

const EVERY = 3000; // ms between two looks
const list = document.querySelector("ul.runs");
const lives = () => list.querySelector("li.run:not(.over)") !== null;

// Makes a node like another one, from the top down: whoever has the focus or a tick in it stays there.
function become(mine, fresh) {
  if (mine.isEqualNode(fresh)) return;
  if (mine.nodeType !== Node.ELEMENT_NODE || mine.nodeName !== fresh.nodeName) return void mine.replaceWith(fresh);
  for (const { name } of [...mine.attributes]) if (!fresh.hasAttribute(name)) mine.removeAttribute(name);
  for (const { name, value } of fresh.attributes) mine.setAttribute(name, value);
  const parts = [...mine.childNodes], wanted = [...fresh.childNodes];
  mine.append(...wanted.slice(parts.length));
  parts.forEach((part, at) => (at < wanted.length ? become(part, wanted[at]) : part.remove()));
}

// Runs keep their rows where they are; new ones come in, and those that are gone go.
function update(fresh) {
  const known = new Map([...list.children].map((row) => [row.dataset.run, row]));
  const news = [...fresh.children], rows = news.map((row) => known.get(row.dataset.run) ?? row);
  if (rows.length !== list.children.length || rows.some((row, at) => row !== list.children[at])) list.replaceChildren(...rows);
  rows.forEach((row, at) => become(row, news[at]));
}

export function following() {
  if (!list) return;
  const said = document.getElementById("runs-said");

  async function look() {
    const page = await fetched(list.dataset.address, said);
    if (page) said.textContent = "";
    const fresh = page?.querySelector("ul.runs");
    if (fresh) update(fresh);
  }

  follow(look, lives, EVERY);
}
