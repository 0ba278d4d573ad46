// The rest of the state: the box, the button, what is dry, the supervisor. One picker for each thing that varies; the server
// draws the board of each.
const PLACE = /row \d+,? column \d+/, PLACES = /row (\d+),? column (\d+)/g; // many of them fit into a line in short
const $ = (id) => document.getElementById(id);

// Calls `turned` once another rest is drawn, and `failed` where its board did not come: then the former one stays picked.
export function pickers(run, known, turned, failed) {
  const holder = $("seen-rests"), over = $("seen-over"), drawn = new Map(), offered = {};
  const names = JSON.parse($("seen").dataset.legend);
  let rest = 0, wanted = 0; // what is drawn, and what was picked last

  const parts = (at) => known.rests[at]?.parts ?? {};

  // The rest that has what was just picked and most of what the other pickers say.
  function nearest(name, value) {
    const now = parts(wanted);
    const like = (at) => Object.entries(parts(at)).filter(([other, found]) => now[other] === found).length;
    const fitting = known.rests.map((_, at) => at).filter((at) => parts(at)[name] === value);
    return fitting.reduce((best, at) => (like(at) > like(best) ? at : best), fitting[0]);
  }

  async function boardOf(at) {
    if (!drawn.has(at)) {
      const reply = await fetch(`/runs/${run}/board/${at}`).catch(() => null);
      if (!reply?.ok) return null;
      const part = document.createElement("template");
      part.innerHTML = await reply.text();
      drawn.set(at, part.content.querySelector("svg"));
    }
    return drawn.get(at);
  }

  function show(at, board) {
    rest = at;
    over.querySelector(".board").replaceWith(board.cloneNode(true));
    turned();
  }

  function say(at) {
    wanted = at;
    for (const select of holder.querySelectorAll("select")) select.value = parts(at)[select.name];
  }

  // The board and what is painted over it change together: no arrow stands over the board of another rest.
  async function choose(at) {
    say(at);
    over.setAttribute("aria-busy", true);
    const board = await boardOf(at);
    if (wanted !== at) return; // another was picked meanwhile
    over.removeAttribute("aria-busy");
    if (board) return show(at, board);
    say(rest);
    failed();
  }

  holder.addEventListener("change", (event) => {
    event.stopPropagation();
    choose(nearest(event.target.name, event.target.value));
  });

  return {
    get rest() { return rest; },
    wall: (row, column) => known.rests[rest]?.ground[row]?.[column] === "#",
    tile(row, column) {
      const { ground, box } = known.rests[rest] ?? {}, tile = ground?.[row]?.[column];
      if (!tile) return "";
      const name = names[tile] ?? tile;
      return box?.[0] === row && box[1] === column ? `Box on ${name}` : name[0].toUpperCase() + name.slice(1);
    },
    // Offer what varies among the rests that are known by now.
    offer() {
      const values = {};
      for (const { parts } of known.rests) for (const [name, value] of Object.entries(parts)) (values[name] ??= new Set()).add(value);
      for (const [name, found] of Object.entries(values)) {
        if (found.size < 2 || offered[name]?.options.length === found.size) continue;
        if (!offered[name]) {
          const label = Object.assign(document.createElement("label"), { className: "pick" });
          offered[name] = Object.assign(document.createElement("select"), { name });
          const places = [...found].some((value) => PLACE.test(value)) ? " (row/column)" : "";
          label.append(`${name[0].toUpperCase()}${name.slice(1)}${places} `, offered[name]);
          holder.append(label);
        }
        offered[name].replaceChildren(...[...found].map((value) => new Option(value.replaceAll(PLACES, "$1/$2"), value)));
        offered[name].value = parts(wanted)[name];
      }
    },
  };
}
