// One stream a browser for its parent's pages: a visible page reads it and tells the others. A Web Lock says which one: it
// passes on when its page is hidden or closed, or crashes. Where a page hears nothing, it asks by itself (live.js).
import { client, run } from "./page.js";

const NAME = "parenting.pages";
const SIGN = 1000, QUIET = 3000; // ms between the reader's signs of life, and without one until it counts as gone
const WISH = 5000, FORGET = 15_000; // ms between a page's own signs, and until the reader forgets it
const DEAD = 40_000; // ms without a byte, after which a stream is opened again; the server sends one every 15 s
const FIRST = 1000; // ms that the first stream may take to arrive
const AGAIN = 3000; // ms until a stream that ended is opened again
const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });

// Calls hear(event, data) with what the stream brings for this page; `has()` is what the page has: `shown` and `asks`.
// Returns what says whether something is heard, and what tells the reader that the page has something else.
export function carry(hear, has) {
  if (!navigator.locks || typeof BroadcastChannel !== "function") return { heard: () => false, wish() {} }; // only https and localhost have locks
  const me = `${Math.random()}`, channel = new BroadcastChannel(NAME), pages = new Map();
  const begun = performance.now();
  let last = -Infinity, served = false, stream = null, sent = "", release = null, seek = null;

  const heard = () => (served ? performance.now() - last < QUIET : performance.now() - begun < FIRST);
  const page = () => ({ tab: me, run, client_id: client, ...has() });
  const wish = (again = false) => { if (!document.hidden) tell({ kind: "wish", page: page(), again }); };

  // What pages say to each other. Only the reader minds who wishes for what.
  function take({ kind, page, tab, again, to, event, data }) {
    if (kind === "wish") {
      pages.set(page.tab, { ...page, at: performance.now() });
      reopen(again);
    } else if (kind === "gone" && pages.delete(tab)) reopen();
    else if (kind === "lead") wish();
    else if (kind === "sign") last = performance.now();
    else if (kind === "silent") last = -Infinity;
    else if (kind === "heard" && to.includes(me)) {
      served = event !== "lost";
      hear(event, data);
    }
  }
  function tell(message) {
    channel.postMessage(message);
    take(message);
  }
  channel.onmessage = ({ data }) => take(data);

  // The pages of one run and one client are one to the server.
  function grouped() {
    const groups = new Map();
    for (const { tab, run, client_id, shown, asks, at } of pages.values()) {
      if (performance.now() - at > FORGET) {
        pages.delete(tab);
        continue;
      }
      const name = `${run} ${client_id}`, group = groups.get(name) ?? { run, client_id, shown, asks: false, tabs: [] };
      groups.set(name, { ...group, shown: group.shown.filter((one) => shown.includes(one)), asks: group.asks || asks, tabs: [...group.tabs, tab] });
    }
    return [...groups.values()];
  }
  const signature = (groups) => JSON.stringify(groups.map(({ run, client_id, asks, tabs }) => [run, client_id, asks, tabs]));
  function reopen(again = false) {
    if (stream && (again || signature(grouped()) !== sent)) stream.abort();
  }

  async function read() {
    const groups = grouped(), mine = stream = new AbortController();
    sent = signature(groups);
    let arrived = performance.now(), began = false;
    const watch = setInterval(() => {
      if (performance.now() - arrived > DEAD) mine.abort();
      else if (began) tell({ kind: "sign" });
      reopen(); // somebody may have been forgotten
    }, SIGN);
    try {
      const reply = await fetch("/runs/parent/stream", {
        method: "POST", signal: mine.signal, headers: { "content-type": "application/json" },
        body: JSON.stringify({ pages: groups.map(({ run, client_id, shown, asks }) => ({ run, client_id, shown, asks })) }),
      });
      if (!reply.ok) throw new Error(reply.statusText);
      const reader = reply.body.getReader(), decoder = new TextDecoder();
      let text = "";
      for (let part = await reader.read(); !part.done; part = await reader.read()) {
        arrived = performance.now();
        began = true;
        const events = (text + decoder.decode(part.value, { stream: true })).split("\n\n");
        text = events.pop();
        for (const lines of events) pass(lines, groups);
      }
    } finally { clearInterval(watch); }
  }
  function pass(lines, groups) {
    const event = /^event: (\w+)$/m.exec(lines)?.[1], data = /^data: (.*)$/m.exec(lines)?.[1];
    if (!event || !data) return; // a comment, so that the connection stays
    const [at, what] = JSON.parse(data);
    tell({ kind: "sign" });
    tell({ kind: "heard", to: groups[at].tabs, event, data: what });
  }

  async function lead() {
    tell({ kind: "lead" });
    while (release) {
      const failed = await read().then(() => true, ({ name }) => name !== "AbortError");
      if (!failed || !release) continue;
      tell({ kind: "silent" });
      await pause(AGAIN);
    }
  }
  function begin() {
    if (document.hidden || seek) return;
    wish();
    seek = new AbortController();
    navigator.locks.request(NAME, { signal: seek.signal }, () => new Promise((done) => {
      release = done;
      lead();
    })).catch(() => null); // it was left before it was had
  }
  function end() {
    tell({ kind: "gone", tab: me });
    seek?.abort();
    release?.();
    stream?.abort();
    seek = release = stream = null;
    served = false;
  }
  const turn = () => (document.hidden ? end() : begin());

  setInterval(wish, WISH);
  addEventListener("pagehide", end);
  addEventListener("pageshow", turn);
  document.addEventListener("freeze", end);
  document.addEventListener("resume", turn);
  document.addEventListener("visibilitychange", turn);
  begin();
  return { heard, wish };
}
