// The brushes of the editor: one for each glyph of the world's legend.
import { tile } from "./level_board.js";

export function createPalette(host) {
  let shown = "";

  const boxes = () => [...host.querySelectorAll("input")];

  function brush(glyph, name, on) {
    const label = document.createElement("label"), box = document.createElement("input"), word = document.createElement("span");
    Object.assign(box, { type: "radio", name: "brush", value: glyph, checked: on });
    const picture = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    picture.setAttribute("viewBox", "0 0 20 20");
    picture.setAttribute("aria-hidden", "true");
    picture.append(tile(glyph));
    word.textContent = name;
    label.append(box, picture, word);
    if (glyph !== " ") label.append(Object.assign(document.createElement("kbd"), { textContent: glyph }));
    return label;
  }

  return {
    fill(legend) {
      const key = JSON.stringify(legend), chosen = this.glyph();
      if (key === shown) return;
      shown = key;
      const first = chosen in legend ? chosen : "#";
      for (const old of host.querySelectorAll("label")) old.remove();
      host.append(...Object.entries(legend).map(([glyph, name]) => brush(glyph, name, glyph === first)));
    },
    glyph: () => boxes().find(({ checked }) => checked)?.value ?? "#",
    choose(glyph) {
      for (const box of boxes()) box.checked = box.value === glyph;
    },
  };
}
