// The curves of a run: from the server with at most 2,000 points each, and what was measured since. So neither the page's
// memory nor its drawing grows with the run. A part of the axis that is looked at closely is fetched with points of its own.
const FRESH = 2000; // rows that come in before the curves are fetched again, thinned
const AGAIN = 1000; // ms until a fetch that failed is tried again

const joined = (curves) => ({ x: curves.flatMap(({ x }) => x), y: curves.flatMap(({ y }) => y) });

// Returns the points of a curve at places that `wanted` accepts.
const chosen = ({ x, y }, wanted) => {
  const found = { x: [], y: [] };
  x.forEach((place, at) => { if (wanted(place)) { found.x.push(place); found.y.push(y[at]); } });
  return found;
};

async function fetched(run, names, part) {
  const query = new URLSearchParams({ names: names.join(), ...part });
  const reply = await fetch(`/api/v1/runs/${run}/curves?${query}`).catch(() => null);
  if (!reply?.ok) return null;
  const { curves, ...found } = await reply.json();
  return { ...found, curves: Object.fromEntries(curves.map(({ name, x, y }) => [name, { x, y }])) };
}

// The curves of some metrics; `how` may hold another axis (`by`) and another number of points.
export function curvesOf(run, names, how = {}) {
  let whole = Object.fromEntries(names.map((name) => [name, { x: [], y: [] }]));
  const { by = "tick" } = how; // rows come in by their ticks
  let last = -1, fresh = 0, thinned = false;
  const parts = {}; // what is looked at closely, by chart

  // Fetches all curves; what came in meanwhile stays. Calls `failed` and tries again until it succeeds.
  async function load(failed) {
    fresh = 0;
    let found;
    while (!(found = await fetched(run, names, how))) {
      failed();
      await new Promise((resolve) => setTimeout(resolve, AGAIN));
    }
    const until = found.last ?? -1;
    for (const name of names) whole[name] = by === "tick" ? joined([found.curves[name], chosen(whole[name], (tick) => tick > until)]) : found.curves[name];
    last = Math.max(last, until);
    ({ thinned } = found);
  }

  // Adds rows; those that are known already, or damaged, are passed over. Returns whether it is time to load again.
  function add(rows) {
    for (const { tick, values, damaged } of rows) {
      if (damaged || tick <= last) continue;
      last = tick;
      fresh++;
      for (const name of names) {
        if (typeof values[name] !== "number") continue;
        whole[name].x.push(tick);
        whole[name].y.push(values[name]);
      }
    }
    return fresh >= FRESH;
  }

  // Fetches a part of the axis with points of its own, for a chart; without a part, the chart shows the whole again.
  async function zoom(chart, ofChart, begin, end) {
    delete parts[chart];
    if (begin === undefined || !thinned) return;
    const part = { begin: Math.max(0, begin), end: Math.max(0, end) };
    const wanted = parts[chart] = { ...part, curves: null };
    const found = await fetched(run, ofChart, { ...how, ...part });
    if (parts[chart] !== wanted || !found?.rows) return;
    const ends = Object.values(found.curves).map(({ x }) => x.at(-1) ?? begin);
    Object.assign(wanted, { curves: found.curves, end: Math.max(...ends) });
  }

  // Returns a curve for a chart; one that was never measured has a place without a value, so that its legend stands.
  function curve(chart, name) {
    const part = parts[chart];
    if (!whole[name].x.length) return { x: [null], y: [null] };
    if (!part?.curves) return whole[name];
    return joined([chosen(whole[name], (tick) => tick < part.begin), part.curves[name], chosen(whole[name], (tick) => tick > part.end)]);
  }

  return { load, add, zoom, curve, after: () => last, latest: (name) => whole[name].y.at(-1) };
}
