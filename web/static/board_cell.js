// The cell that is looked at: pointed at, touched, or gone to with the arrow keys. Its numbers stand beside the board, and a
// screen reader is told them in a sentence.
const MOVES = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
const CELL = 20, CALM = 150; // units of a cell; ms until a screen reader is told where the cursor has come to rest
const $ = (id) => document.getElementById(id);
const keys = $("seen-keys"), cursor = $("seen-cursor"), over = $("seen-over");

// `tell([row, column])` returns what is known of a cell: { tile, numbers: { name: text }, spoken }, and whether it is `open`:
// a worker may be asked for it by `ask([row, column])`. Returns what shows the cell again, and tells it again if asked to.
export function cells(tell, ask) {
  let at = null, pointed = null, timer = 0; // where the cursor rests, and where the pointer is
  const view = () => over.querySelector(".painted").viewBox.baseVal;
  const bounds = () => {
    const { x, y, width, height } = view();
    return [Math.ceil(y / CELL), Math.ceil(x / CELL), Math.floor((y + height) / CELL) - 1, Math.floor((x + width) / CELL) - 1];
  };

  function show() {
    const cell = pointed ?? at;
    cursor.setAttribute("visibility", cell ? "visible" : "hidden");
    if (!cell) return;
    cursor.setAttribute("x", cell[1] * CELL);
    cursor.setAttribute("y", cell[0] * CELL);
    const { tile, numbers, open } = tell(cell);
    $("seen-ask").classList.toggle("absent", !open || !!pointed && pointed.join() !== at?.join());
    $("seen-where").textContent = `Row ${cell[0] + 1}, column ${cell[1] + 1}`;
    $("seen-tile").textContent = tile;
    for (const field of $("seen-numbers").querySelectorAll("dd")) field.textContent = numbers[field.dataset.number] ?? "–";
  }

  function say() {
    clearTimeout(timer);
    timer = setTimeout(() => { $("seen-said").textContent = tell(at).spoken; }, CALM);
  }

  function cellAt({ clientX, clientY }) {
    const { left, top, width } = over.querySelector(".painted").getBoundingClientRect(), { x, y, width: units } = view();
    const [top1, left1, bottom, right] = bounds(), scale = units / width;
    const row = Math.floor(((clientY - top) * scale + y) / CELL), column = Math.floor(((clientX - left) * scale + x) / CELL);
    return row >= top1 && row <= bottom && column >= left1 && column <= right ? [row, column] : null;
  }

  function go(row, column) {
    const [top, left, bottom, right] = bounds();
    at = [Math.max(top, Math.min(bottom, row)), Math.max(left, Math.min(right, column))];
    pointed = null;
    show();
    say();
  }

  keys.hidden = false;
  over.addEventListener("pointermove", (event) => { if (event.pointerType === "mouse") { pointed = cellAt(event); show(); } });
  over.addEventListener("pointerleave", () => { pointed = null; show(); });
  over.addEventListener("click", (event) => { const cell = cellAt(event); if (cell) go(...cell); });
  keys.addEventListener("focus", () => { if (keys.matches(":focus-visible") && !at) go(...bounds()); });
  keys.addEventListener("keydown", (event) => {
    const { key, ctrlKey, metaKey, altKey } = event;
    if (metaKey || altKey) return;
    const [top, left, bottom, right] = bounds(), [row, column] = at ?? [top, left];
    if (key in MOVES && !ctrlKey) go(row + MOVES[key][0], column + MOVES[key][1]);
    else if (key === "Home") go(ctrlKey ? top : row, left);
    else if (key === "End") go(ctrlKey ? bottom : row, right);
    else return;
    event.preventDefault();
  });
  $("seen-ask").addEventListener("click", () => { if (at) ask(at); });
  return (aloud = false) => { show(); if (aloud) say(); };
}
