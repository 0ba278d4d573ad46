// What is painted over the board of the dashboard: a layer of shaded cells and the arrows of a policy. Both are a few paths,
// however large the board is: cells of nearly the same opacity share one.
const CELL = 20, LEAST = 0.05; // units of a cell; the probability below which an action has no arrow
const SHORTEST = 3, LONGEST = 9, SHADES = 16; // drawing/policy.py draws arrows of the same lengths
const WAYS = [[0, -1], [0, 1], [-1, 0], [1, 0]]; // up, down, left, right: across and down
const SVG = "http://www.w3.org/2000/svg";
const fixed = (number) => Number(number.toFixed(2));

// The outline of an arrow from the middle of a cell.
export function arrow([row, column], way, probability) {
  const length = SHORTEST + (LONGEST - SHORTEST) * probability, shaft = 0.4 + 0.5 * probability, head = 1.4 + 1.6 * probability;
  const neck = length - 1.5 * head, [dx, dy] = WAYS[way], x = (column + 0.5) * CELL, y = (row + 0.5) * CELL;
  const outline = [[0, shaft], [neck, shaft], [neck, head], [length, 0], [neck, -head], [neck, -shaft], [0, -shaft]];
  return `M${outline.map(([along, aside]) => `${fixed(x + along * dx - aside * dy)},${fixed(y + along * dy + aside * dx)}`).join("L")}z`;
}

function put(layer, shades) {
  const paths = shades.map((text, shade) => {
    if (!text) return null;
    const path = document.createElementNS(SVG, "path");
    path.setAttribute("d", text);
    path.setAttribute("opacity", fixed((shade + 1) / SHADES));
    return path;
  });
  layer.replaceChildren(...paths.filter(Boolean));
}

const shadeOf = (share) => Math.min(SHADES - 1, Math.floor(share * SHADES));

// The arrows of a policy: rows of four probabilities by cell, in the order of `cells`; null where nothing is known.
export function paintArrows(layer, cells, rows) {
  const shades = Array(SHADES).fill("");
  rows.forEach((row, at) => row?.forEach((probability, way) => {
    if (probability >= LEAST) shades[shadeOf(probability)] += arrow(cells[at], way, probability);
  }));
  put(layer, shades);
}

// A layer: the share of the largest value by cell, from 0 to 1; nothing is painted at 0 and where nothing is known.
export function paintShares(layer, cells, shares) {
  const shades = Array(SHADES).fill("");
  shares.forEach((share, at) => {
    if (share > 0) shades[shadeOf(share)] += `M${cells[at][1] * CELL} ${cells[at][0] * CELL}h${CELL}v${CELL}h-${CELL}z`;
  });
  put(layer, shades);
}
