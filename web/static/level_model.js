// A level while it is edited: its header and its rows, as text and back, and the states to undo.
const WALL = "#", DEEPEST = 500;

const entries = (header) => Object.entries(header).filter(([, value]) => value);

// The lines of a header with the empty one behind it.
export const headerLines = (header) => (entries(header).length ? entries(header).length + 1 : 0);

export function compose({ header, rows }) {
  const lines = entries(header).map(([key, value]) => `${key}: ${value}`);
  return [...lines, ...(lines.length ? [""] : []), ...rows, ""].join("\n");
}

// Rows of one length: those that are shorter end in land.
export function parse(world, lines, rows) {
  const header = {};
  for (const line of lines) {
    const [, key, value] = line.match(/^\s*([^:]*?)\s*:\s*(.*?)\s*$/) ?? [];
    if (key && key !== "world") header[key] = value;
  }
  const width = Math.max(0, ...rows.map((row) => [...row].length));
  return { world, header, rows: rows.length ? rows.map((row) => row.padEnd(width)) : [""] };
}

// More cells are wall, on the right and below.
export function resize(rows, height, width) {
  const wide = rows.slice(0, height).map((row) => row.slice(0, width).padEnd(width, WALL));
  return [...wide, ...Array.from({ length: height - wide.length }, () => WALL.repeat(width))];
}

export function createHistory() {
  let states = [], now = -1;
  return {
    add(state) {
      if (now >= 0 && JSON.stringify(states[now]) === JSON.stringify(state)) return;
      states = [...states.slice(Math.max(0, now + 2 - DEEPEST), now + 1), state];
      now = states.length - 1;
    },
    can: (way) => (way === "undo" ? now > 0 : now < states.length - 1),
    undo: () => states[--now],
    redo: () => states[++now],
  };
}
