// The board as a grid of cells that arrow keys explore while the focus is in it (the ARIA grid pattern). Escape leaves it.
// The server names the cells at each step of the clips; this file lays them over the board and moves the focus.
import { alarm, page } from "./page.js";

const MOVES = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
const STEPS = { ",": -1, ".": 1 };
let before = null; // what had the focus

async function fetchGrid(form, step) {
  const reply = await fetch(`${form.dataset.grid}&step=${step}`);
  if (!reply.ok) throw new Error(reply.statusText);
  const holder = document.createElement("template");
  holder.innerHTML = await reply.text();
  return holder.content.firstElementChild;
}

const rows = (grid) => [...grid.children].map((row) => [...row.children]);
const boards = (form) => [...form.querySelectorAll(form.matches(".one") ? ".meeting" : ".card .board")].filter((board) => getComputedStyle(board).visibility === "visible");

// Lay a grid over the board, or over the first of two.
function place(grid, form) {
  const [board] = boards(form), host = grid.parentElement, from = host.getBoundingClientRect();
  if (!board) return;
  const { x, width } = board.viewBox.baseVal, cell = 20 * board.getBoundingClientRect().width / width;
  const [row, column] = grid.dataset.first.split(" ").map(Number), { left, top } = board.getBoundingClientRect();
  grid.style.left = `${left - from.left + host.scrollLeft + (column * 20 - x) * cell / 20}px`;
  grid.style.top = `${top - from.top + host.scrollTop + (row * 20 - board.viewBox.baseVal.y) * cell / 20}px`;
  grid.style.setProperty("--cell", `${cell}px`);
}

function find(grid) {
  const all = rows(grid), row = all.findIndex((cells) => cells.some(({ tabIndex }) => tabIndex === 0));
  return [row, all[row].findIndex(({ tabIndex }) => tabIndex === 0)];
}

function go(grid, row, column) {
  const all = rows(grid), to = all[Math.max(0, Math.min(all.length - 1, row))].at(Math.max(0, Math.min(all[0].length - 1, column)));
  const [r, c] = find(grid);
  all[r][c].tabIndex = -1;
  to.tabIndex = 0;
  to.focus({ preventScroll: true });
  to.scrollIntoView({ block: "nearest", inline: "nearest" });
}

// Name the same cells at another step of the clips.
async function tell(grid, form, step) {
  const at = find(grid), now = Math.max(0, Math.min(Number(grid.dataset.steps), step));
  if (now === Number(grid.dataset.step)) return;
  const other = await fetchGrid(form, grid.dataset.step = now);
  if (!grid.isConnected || Number(grid.dataset.step) !== now) return; // left, or two steps further by now
  const focused = grid.contains(document.activeElement);
  grid.setAttribute("aria-label", other.getAttribute("aria-label"));
  grid.replaceChildren(...other.children);
  for (const cell of grid.querySelectorAll("[tabindex='0']")) cell.tabIndex = -1;
  rows(grid)[at[0]][at[1]].tabIndex = 0;
  if (focused) go(grid, ...at);
}

function step(grid, form, by) {
  page.player.go?.(by);
  tell(grid, form, Number(grid.dataset.step) + by).catch(({ message }) => alarm(message));
}

function leave(grid, form) {
  (before?.isConnected && before !== document.body ? before : form.querySelector("[data-explore]")).focus({ preventScroll: true });
}

function keys(grid, form, event) {
  if (event.metaKey || event.altKey) return;
  const { key, ctrlKey } = event, [row, column] = find(grid);
  if (key in MOVES && !ctrlKey) go(grid, row + MOVES[key][0], column + MOVES[key][1]);
  else if (key === "Home") go(grid, ctrlKey ? 0 : row, 0);
  else if (key === "End") go(grid, ctrlKey ? Infinity : row, Infinity);
  else if (key in STEPS && !ctrlKey) step(grid, form, STEPS[key]);
  else if (key === "Escape") leave(grid, form);
  else return;
  event.preventDefault();
  event.stopPropagation(); // an arrow answers nothing here
}

// Move the focus into the grid of a question.
export async function explore(form) {
  const had = document.activeElement;
  page.player.go?.(0); // the clips stand still while they are explored
  const now = page.player.step?.() ?? 0;
  let grid = form.querySelector("[role=grid]");
  try {
    if (grid) await tell(grid, form, now);
    else {
      grid = await fetchGrid(form, now);
      if (!form.isConnected || form.querySelector("[role=grid]")) return; // another question, or asked twice
      (form.querySelector(".scene") ?? form.querySelector(".cards").parentElement).append(grid);
      grid.addEventListener("keydown", (event) => keys(grid, form, event));
      new ResizeObserver(() => place(grid, form)).observe(form);
    }
  } catch ({ message }) { return alarm(message); }
  if (!grid.contains(had)) before = had;
  place(grid, form);
  go(grid, ...find(grid));
}
