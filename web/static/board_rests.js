// The rest of the state: the box, the button, what is dry, the supervisor. One picker for each thing that varies; the server
// draws the board of each.
const $ = (id) => document.getElementById(id);

export function pickers(run, known, turned) {
  const holder = $("seen-rests"), over = $("seen-over"), drawn = new Map(), offered = {};
  const names = JSON.parse($("seen").dataset.legend);
  let rest = 0;

  const parts = (at) => known.rests[at]?.parts ?? {};

  // The rest that has what was just picked and most of what the other pickers say.
  function nearest(name, value) {
    const now = parts(rest);
    const like = (at) => Object.entries(parts(at)).filter(([other, found]) => now[other] === found).length;
    const fitting = known.rests.map((_, at) => at).filter((at) => parts(at)[name] === value);
    return fitting.reduce((best, at) => (like(at) > like(best) ? at : best), fitting[0]);
  }

  async function draw() {
    const mine = rest;
    if (!drawn.has(mine)) {
      const reply = await fetch(`/runs/${run}/board/${mine}`).catch(() => null);
      if (!reply?.ok) return;
      const part = document.createElement("template");
      part.innerHTML = await reply.text();
      drawn.set(mine, part.content.querySelector("svg"));
    }
    if (mine === rest) over.querySelector(".board").replaceWith(drawn.get(mine).cloneNode(true));
  }

  function choose(at) {
    rest = at;
    for (const select of holder.querySelectorAll("select")) select.value = parts(rest)[select.name];
    draw();
    turned();
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
          label.append(`${name[0].toUpperCase()}${name.slice(1)} `, offered[name]);
          holder.append(label);
        }
        offered[name].replaceChildren(...[...found].map((value) => new Option(value)));
        offered[name].value = parts(rest)[name];
      }
    },
  };
}
