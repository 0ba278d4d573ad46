// The board of the editor: tiles under a grid of cells (the ARIA grid pattern), painted by pointer and keys.
const NS = "http://www.w3.org/2000/svg", SIDE = 20;
const MOVES = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
const PIECES = { A: "#agent", X: "#crate" }; // of each there is one: painted elsewhere, it moves

const make = (name, attributes) => {
  const made = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
};

// The tile of a glyph, as boards of questions show it; of one that no world has, its letter.
export function tile(glyph, x = 0, y = 0) {
  const id = `tile-${glyph in PIECES || glyph === " " ? "20" : glyph}`, group = make("g", { transform: `translate(${x * SIDE} ${y * SIDE})` });
  if (glyph === "#") group.append(make("rect", { class: "wall", width: SIDE, height: SIDE }), make("path", { class: "grid", d: "M0 .25h20M.25 0v20" }));
  else if (document.getElementById(id)) group.append(make("rect", { fill: `url(#${id})`, width: SIDE, height: SIDE }));
  else group.append(make("rect", { class: "land", width: SIDE, height: SIDE }), Object.assign(make("text", { class: "letter", x: SIDE / 2, y: SIDE / 2 }), { textContent: glyph }));
  if (glyph in PIECES) group.append(make("use", { href: PIECES[glyph], x: SIDE / 2, y: SIDE / 2 }));
  return group;
}

// The cells between two, so that a fast stroke leaves no gap.
function between([r, c], [toR, toC]) {
  const steps = Math.max(Math.abs(toR - r), Math.abs(toC - c), 1);
  return Array.from({ length: steps }, (_, i) => [Math.round(r + ((toR - r) * (i + 1)) / steps), Math.round(c + ((toC - c) * (i + 1)) / steps)]);
}

export function createBoard(host, { brush, choose, painted, undo, redo }) {
  const [picture, grid] = [host.querySelector("svg"), host.querySelector("[role=grid]")];
  let rows = [], names = {}, at = [0, 0], last = null, wrong = null;

  const cell = ([r, c]) => grid.children[r]?.children[c];
  const inside = ([r, c]) => r >= 0 && c >= 0 && r < rows.length && c < rows[0].length;
  const label = ([r, c]) => cell([r, c]).setAttribute("aria-label", `${names[rows[r][c]] ?? rows[r][c]}, row ${r + 1}, column ${c + 1}`);

  function build() {
    grid.replaceChildren(...rows.map((row, r) => {
      const line = document.createElement("div");
      line.setAttribute("role", "row");
      line.append(...[...row].map(() => Object.assign(document.createElement("div"), { tabIndex: -1 })));
      [...line.children].forEach((one, c) => { one.setAttribute("role", "gridcell"); one.dataset.at = `${r} ${c}`; });
      return line;
    }));
    picture.setAttribute("viewBox", `0 0 ${rows[0].length * SIDE} ${rows.length * SIDE}`);
    picture.replaceChildren(...rows.flatMap((row, r) => [...row].map((glyph, c) => tile(glyph, c, r))));
    const stage = host.closest(".stage").style;
    stage.setProperty("--rows", rows.length);
    stage.setProperty("--columns", rows[0].length);
  }

  function put([r, c], glyph) {
    rows[r] = rows[r].slice(0, c) + glyph + rows[r].slice(c + 1);
    picture.children[r * rows[0].length + c].replaceWith(tile(glyph, c, r));
    label([r, c]);
  }

  // Paint a cell of the stroke that goes on.
  function paint(place, glyph = brush()) {
    if (!inside(place) || rows[place[0]][place[1]] === glyph) return;
    if (glyph in PIECES) rows.forEach((row, r) => [...row].forEach((one, c) => one === glyph && put([r, c], " ")));
    put(place, glyph);
  }

  function focus(place, moved = true) {
    const to = [Math.max(0, Math.min(rows.length - 1, place[0])), Math.max(0, Math.min(rows[0].length - 1, place[1]))];
    const old = cell(at);
    if (old) old.tabIndex = -1;
    at = to;
    cell(at).tabIndex = 0;
    if (moved) cell(at).focus({ preventScroll: false });
  }

  const placeOf = ({ clientX, clientY }) => document.elementFromPoint(clientX, clientY)?.closest?.("[data-at]")?.dataset.at.split(" ").map(Number);
  const end = () => { if (last) painted([...rows]); last = null; };

  grid.addEventListener("pointerdown", (event) => {
    const place = placeOf(event);
    if (!place || event.button) return;
    event.preventDefault();
    grid.setPointerCapture(event.pointerId);
    focus(place);
    paint(last = place);
  });
  grid.addEventListener("pointermove", (event) => {
    const place = last && placeOf(event);
    if (!place || String(place) === String(last)) return;
    for (const one of between(last, place)) paint(one);
    last = place;
  });
  for (const name of ["pointerup", "pointercancel"]) grid.addEventListener(name, end);

  grid.addEventListener("focusin", ({ target }) => {
    const place = target.dataset.at?.split(" ").map(Number);
    if (place && String(place) !== String(at)) focus(place, false);
  });
  grid.addEventListener("keydown", (event) => {
    const { key, ctrlKey, metaKey, shiftKey, altKey } = event, command = ctrlKey || metaKey;
    if (altKey) return;
    if (command && key.toLowerCase() === "z") (shiftKey ? redo : undo)();
    else if (command && key.toLowerCase() === "y") redo();
    else if (key in MOVES && !command) {
      focus([at[0] + MOVES[key][0], at[1] + MOVES[key][1]]);
      if (shiftKey) { paint(at); painted([...rows]); }
    } else if (key === "Home") focus([command ? 0 : at[0], 0]);
    else if (key === "End") focus([command ? Infinity : at[0], Infinity]);
    else if (key === " " || key === "Enter") { paint(at); painted([...rows]); }
    else if (key === "Delete" || key === "Backspace") { paint(at, " "); painted([...rows]); }
    else if (key in names && !command) { choose(key); paint(at, key); painted([...rows]); }
    else return;
    event.preventDefault();
  });

  return {
    draw(next, legend) {
      const same = next.length === rows.length && next[0].length === rows[0]?.length, had = grid.contains(document.activeElement);
      names = legend;
      if (same) next.forEach((row, r) => [...row].forEach((glyph, c) => rows[r][c] !== glyph && put([r, c], glyph)));
      rows = [...next];
      if (!same) build();
      rows.forEach((row, r) => [...row].forEach((_, c) => label([r, c])));
      focus(at, had && !same);
    },
    // Mark the cell that breaks a rule; false if the board has no such cell.
    mark(place) {
      const old = wrong && cell(wrong);
      old?.removeAttribute("aria-invalid");
      old?.removeAttribute("aria-describedby");
      wrong = place && inside(place) ? place : null;
      if (!wrong) return false;
      cell(wrong).setAttribute("aria-invalid", "true");
      cell(wrong).setAttribute("aria-describedby", "beside");
      return true;
    },
  };
}
