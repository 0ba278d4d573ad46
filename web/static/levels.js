// The editor of levels: a level is painted or opened, checked by the server while it changes, and sent as text.
import "./errors.js";
import { compose, createHistory, headerLines, parse, resize } from "./level_model.js";
import { createBoard } from "./level_board.js";
import { createPalette } from "./level_palette.js";
import { decode, listen, save } from "./level_files.js";

const WAIT = 300; // ms without a change, after which the server is asked
const at = (id) => document.getElementById(id);
const world = at("world"), area = at("level_text"), told = at("told"), beside = at("beside"), form = area.form;
const [least, most] = [form.dataset.smallest, form.dataset.largest].map(Number);
const fields = [...document.querySelectorAll("[data-key]")];
const chosen = () => world.selectedOptions[0].dataset;
const legend = () => JSON.parse(chosen().legend), builtIn = () => JSON.parse(chosen().levels);
const history = createHistory(), palette = createPalette(at("brushes"));
const board = createBoard(at("board"), { brush: palette.glyph, choose: palette.choose, painted, undo: () => go("undo"), redo: () => go("redo") });
let state, asked = 0, timer, notes = [];

const line = (text, kind) => Object.assign(document.createElement("p"), { textContent: text, className: kind });
const sentence = (text) => `${text[0].toUpperCase()}${text.slice(1)}.`;

// Show a state everywhere; what the person types in keeps its text.
function show() {
  if (world.value !== state.world) world.value = state.world;
  palette.fill(legend());
  board.draw(state.rows, legend());
  for (const field of fields) {
    const own = field.dataset.key === "name" || chosen().keys.split(" ").includes(field.dataset.key);
    field.parentElement.hidden = !own;
    if (field !== document.activeElement) field.value = state.header[field.dataset.key] ?? "";
  }
  at("begin").replaceChildren(...["", ...Object.keys(builtIn())].map((name) => new Option(name || "choose a level", name)));
  at("rows").value = state.rows.length;
  at("columns").value = state.rows[0].length;
  at("undo").disabled = !history.can("undo");
  at("redo").disabled = !history.can("redo");
  area.value = compose(state);
  clearTimeout(timer);
  timer = setTimeout(check, WAIT);
}

function change(next) {
  state = next;
  history.add(state);
  notes = [];
  show();
}

function painted(rows) {
  change({ ...state, rows });
}

function go(way) {
  if (!history.can(way)) return;
  state = history[way]();
  show();
}

async function ask(verb, body) {
  const reply = await fetch(`/api/v1/levels/${verb}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  const found = await reply.json();
  if (!reply.ok) throw new Error(found.error.message);
  return found;
}

async function check() {
  const mine = ++asked;
  try {
    const found = await ask("check", { world: world.value, text: compose(state) });
    if (mine === asked) tell(found);
  } catch ({ message }) {
    if (mine === asked) told.replaceChildren(line(`It could not be checked. ${message}`, "error"));
  }
}

// The first broken rule, beside its cell, and what was cut.
function tell({ valid, error, said, cost }) {
  const cell = error && [error.line - 1 - headerLines(state.header), error.column - 1];
  const onBoard = board.mark(cell), title = world.selectedOptions[0].text;
  beside.hidden = !onBoard;
  beside.textContent = onBoard ? sentence(error.rule) : "";
  if (onBoard) beside.style.setProperty("--row", cell[0]);
  const lines = [...notes, ...said.map(sentence)].map((text) => line(text, "hint"));
  if (error) lines.push(line(onBoard ? `Row ${cell[0] + 1}, column ${cell[1] + 1}: ${error.rule}.` : error.message, onBoard ? "sr" : "error"));
  if (cost) lines.push(line(cost, "hint"));
  if (valid) lines.push(line(`This level keeps every rule of ${title}.`, "fine"));
  told.replaceChildren(...lines);
}

// Open a text as people have it; the server takes it apart.
async function open(text, which) {
  const named = text.match(/^\s*world:\s*(\S+)\s*$/m)?.[1];
  if (named && [...world.options].some(({ value }) => value === named)) world.value = named;
  const several = at("several");
  try {
    const found = await ask("check", { world: world.value, text, which: which ?? null });
    if (found.foreign && which === undefined) return await openMaps(text);
    several.hidden = found.levels.length < 2;
    if (which === undefined && found.levels.length > 1) {
      at("which").replaceChildren(...found.levels.map((name, i) => new Option(`${i + 1} ${name}`, String(i + 1))));
      at("which").onchange = ({ target }) => open(text, target.value);
      return await open(text, "1");
    }
    enter(parse(world.value, found.header, found.rows), found.said.map(sentence), found.error?.message);
  } catch (error) {
    refuse(error);
  }
}

function refuse({ message }) {
  world.value = state.world;
  told.replaceChildren(line(`The text was not opened. ${message}`, "error"));
}

function enter(next, said, reason = "This is not a level.") {
  const sizes = [next.rows.length, next.rows[0].length];
  if (Math.min(...sizes) < least || Math.max(...sizes) > most) throw new Error(reason);
  change(next);
  notes = said;
}

// Open the levels that the server makes of a text with maps of another collection.
async function openMaps(text) {
  const { recognised, levels } = await ask("import", { text });
  const carried = ({ world: of, text: whole, lost, refused }) => {
    world.value = of;
    enter(parse(of, ...split(whole)), [recognised, ...[...lost, ...(refused ? [refused] : [])].map(sentence)]);
  };
  at("several").hidden = levels.length < 2;
  at("which").replaceChildren(...levels.map(({ name }, i) => new Option(`${i + 1} ${name}`, String(i))));
  at("which").onchange = ({ target }) => {
    try {
      carried(levels[target.value]);
    } catch (error) {
      refuse(error);
    }
  };
  carried(levels[0]);
}

function otherWorld() {
  const [first] = Object.values(builtIn()), glyphs = legend();
  const untouched = !history.can("undo");
  const kept = state.rows.map((row) => row.replace(/[^]/gu, (glyph) => (glyph in glyphs ? glyph : " ")));
  change(untouched ? parse(world.value, ...split(first)) : { ...state, world: world.value, rows: kept });
}

// A built-in level's text as its header's lines and its rows.
function split(text) {
  const lines = text.replace(/\n$/, "").split("\n"), empty = lines.indexOf("");
  return [lines.slice(0, Math.max(0, empty)), lines.slice(empty + 1)];
}

function resized() {
  const [rows, columns] = [at("rows"), at("columns")].map(({ value }) => Math.min(most, Math.max(least, Math.round(Number(value)) || least)));
  change({ ...state, rows: resize(state.rows, rows, columns) });
}

for (const hidden of form.querySelectorAll(".tools > [hidden], #canvas")) hidden.hidden = false;
at("as-text").open = false;
at("check").hidden = true;
world.addEventListener("change", otherWorld);
at("begin").addEventListener("change", ({ target }) => target.value && change(parse(world.value, ...split(builtIn()[target.value]))));
for (const id of ["rows", "columns"]) at(id).addEventListener("change", resized);
for (const field of fields) field.addEventListener("change", () => change({ ...state, header: { ...state.header, [field.dataset.key]: field.value.trim() } }));
for (const way of ["undo", "redo"]) at(way).addEventListener("click", () => go(way));
area.addEventListener("change", () => open(area.value));
at("download").addEventListener("click", () => save(compose({ ...state, header: { world: state.world, ...state.header } }), state.header.name || "level"));
at("open").addEventListener("click", () => at("file").click());
at("file").addEventListener("change", async ({ target }) => {
  const [file] = target.files;
  target.value = "";
  if (!file) return;
  try { await open(decode(new Uint8Array(await file.arrayBuffer()))); } catch ({ message }) { told.replaceChildren(line(message, "error")); }
});
listen(document, open);

state = parse(world.value, ...split(builtIn()[Object.keys(builtIn())[0]]));
history.add(state);
show();
const first = area.defaultValue;
if (first.trim() && first.trimEnd() !== compose(state).trimEnd()) open(first);
