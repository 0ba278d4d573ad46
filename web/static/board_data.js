// The stored board of a run: which states there are, which snapshots, and the numbers of one (docs/api.md, "The board").
const KEPT = 24; // snapshots that stay decoded: a slider goes back and forth among few

async function get(path) {
  const reply = await fetch(path);
  if (!reply.ok) throw Object.assign(new Error((await reply.json().catch(() => null))?.error?.message ?? reply.statusText), { status: reply.status });
  return reply.json();
}

function decode(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

export function boardOf(run) {
  const kept = new Map(), known = { rests: [], cells: [], snapshots: [], complete: true };
  return {
    known,
    // Ask for what is new: states are only ever added. Resolves to whether a snapshot was.
    async news() {
      const last = known.snapshots.at(-1)?.tick ?? -1;
      const found = await get(`/api/v1/runs/${run}/board?after=${last}&states=${known.cells.length}&rests=${known.rests.length}`);
      known.complete = found.complete;
      known.rests.push(...found.rests);
      known.cells.push(...found.cells);
      known.snapshots.push(...found.snapshots.filter(({ tick }) => tick > last));
      return found.snapshots.length > 0;
    },
    // The numbers of a snapshot, by state.
    async at(tick, stage) {
      const key = `${tick}/${stage ?? ""}`;
      if (!kept.has(key)) {
        const found = await get(`/api/v1/runs/${run}/board/${tick}${stage ? `?stage=${stage}` : ""}`);
        const policy = decode(found.policy, Uint8Array), familiarity = decode(found.familiarity, Uint16Array);
        const numbers = {
          ...found,
          policy: (state) => {
            const row = policy.subarray(4 * state, 4 * state + 4);
            return row.some((share) => share) ? [...row].map((share) => share / 255) : null;
          },
          familiarity,
          ask: Float32Array.from(familiarity, (f) => (found.p_guid ? found.p_guid ** f : 0)),
          visits: decode(found.visits, Uint32Array),
          deaths: decode(found.deaths, Uint32Array),
          entries: decode(found.entries, Uint32Array),
        };
        if (found.partial) return numbers; // the whole one has the same tick
        kept.set(key, numbers);
        if (kept.size > KEPT) kept.delete(kept.keys().next().value);
      }
      return kept.get(key);
    },
  };
}
