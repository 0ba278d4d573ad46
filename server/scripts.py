"""One script a page, made of its ES module and all that it imports, and a script for each part loaded later.

Each module becomes a block with names of its own; `$m` holds what each exports. `import("./later.js")` makes
a script of its own of that module and of all that only it needs, addressed by its content. It is given `$m`,
so that it shares the modules that the page runs already; a module that two such scripts carry runs once. The
page's script alone holds the addresses, so that modules may load each other without end.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from parenting.server.modules import DYNAMIC, AssetError, Import, Module, read_module

LOAD = """\
const $l = {};
let $n = 0;
const $load = (name) => $l[name] ??= import($a[name] + ($n ? `#${$n}` : "")).then(
  (found) => found.default($m, $load),
  (error) => { delete $l[name]; $n++; throw error; }
);
"""
"""Loads a script once. One that did not arrive is asked for again, by another address: a browser may keep the
failure of the first."""


@dataclass(frozen=True, slots=True)
class Scripts:
    """A page's script, given the addresses of its later parts, and those parts by their modules."""

    heads: str
    blocks: str
    parts: Mapping[str, str]

    def page(self, addresses: Mapping[str, str]) -> str:
        """Return the page's script."""
        if not self.parts:
            return self.heads + self.blocks
        known = ", ".join(f'{_key(one)}: "{addresses[one]}"' for one in self.parts)
        return f"{self.heads}const $a = {{ {known} }};\n{LOAD}{self.blocks}"


def scripts(name: str, folder: Path) -> Scripts:
    """Put a page's scripts together.

    Raises:
        AssetError: a form of import or export is not supported, a name is imported that is not exported, or a
            cycle imports something other than a function; the sentence names file and line.
    """
    modules = _closure(name, folder)
    _check(modules)
    wanted = _wanted(modules)
    order = _order(name, modules)
    for module in modules.values():
        module.text = DYNAMIC.sub(lambda found: _loading(found[1], order), module.text)
    parts = {}
    for later, known in _known(name, order, modules).items():
        own = [one for one in _order(later, modules) if one not in known]
        blocks = _blocks(own, modules, wanted, known, "if (!$m.{key}) {{ $m.{key} = {{}};\n{text}}}\n")
        parts[later] = f"export default ($m, $load) => {{\n{blocks}return $m.{_key(later)};\n}};\n"
    blocks = _blocks(order, modules, wanted, (), "{{\n{text}}}\n")
    heads = ", ".join(f"{_key(one)}: {{}}" for one in order)
    return Scripts(f"const $m = {{ {heads} }};\n", blocks, parts)


def _closure(name: str, folder: Path) -> dict[str, Module]:
    """Return a module and all that it needs, at once or later."""
    found: dict[str, Module] = {}
    ahead = [name]
    while ahead:
        one = ahead.pop()
        if one not in found:
            found[one] = module = read_module(one, folder)
            ahead += [*module.statics(), *module.dynamic]
    return found


def _order(name: str, modules: Mapping[str, Module]) -> list[str]:
    """Return a module after those that it imports, in the order in which a browser would run them."""
    order: list[str] = []
    begun: set[str] = set()

    def visit(one: str) -> None:
        begun.add(one)
        for origin in modules[one].statics():
            if origin not in begun:
                visit(origin)
        order.append(one)

    visit(name)
    return order


def _known(name: str, order: Sequence[str], modules: Mapping[str, Module]) -> dict[str, set[str]]:
    """Return, for each part that loads later, the modules that have run by then, whoever loads it."""
    parts = sorted({one for module in modules.values() for one in module.dynamic} - set(order))
    held = {name: set(order), **{part: set(_order(part, modules)) for part in parts}}
    loaders = {
        part: [one for one in held if any(part in modules[inner].dynamic for inner in held[one])]
        for part in parts
    }
    known = {name: set[str](), **{part: set(modules) for part in parts}}
    while True:
        before = {part: set(found) for part, found in known.items()}
        for part in parts:
            known[part] = set.intersection(*(known[one] | held[one] for one in loaders[part]))
        if known == before:
            return {part: known[part] for part in parts}


def _check(modules: Mapping[str, Module]) -> None:
    """Refuse an import of what is not exported, or of what may change afterwards."""
    for module in modules.values():
        for one in module.imports:
            origin = modules[one.origin]
            for name, _ in one.names:
                where = f"{module.name}:{one.line} imports {name} of {one.origin}"
                if name not in origin.exports:
                    raise AssetError(f"{where}, which has no such export.")
                if origin.exports[name] in origin.variables:
                    raise AssetError(
                        f"{where}, which may change it later: a name would hold its first value. "
                        f'Write import * as it from "./{one.origin}" and it.{name}.'
                    )


def _wanted(modules: Mapping[str, Module]) -> dict[str, set[str]]:
    """Return the exports of each module that somebody takes."""
    wanted: dict[str, set[str]] = {name: set() for name in modules}
    for module in modules.values():
        for one in module.imports:
            wanted[one.origin] |= {name for name, _ in one.names}
            wanted[one.origin] |= set(modules[one.origin].exports) if one.whole else set()
        for later in module.dynamic:
            wanted[later] |= set(modules[later].exports)
    return wanted


def _blocks(
    order: Iterable[str],
    modules: Mapping[str, Module],
    wanted: Mapping[str, set[str]],
    known: Iterable[str],
    frame: str,
) -> str:
    done = set(known)
    texts = []
    for name in order:
        text = _block(modules[name], modules, done, wanted[name])
        texts.append(frame.format(key=_key(name), text=text))
        done.add(name)
    return "".join(texts)


def _block(module: Module, modules: Mapping[str, Module], done: set[str], wanted: set[str]) -> str:
    """Return a module's text, between its functions with what it takes and the rest that it exports."""
    taken = "".join(_taken(one, module, modules[one.origin], one.origin in done) for one in module.imports)
    early = {name for name in wanted if module.exports[name] in module.functions}
    live = {name for name in wanted if module.exports[name] in module.variables}
    given = [_pair(name, module.exports[name]) for name in sorted(wanted - early - live)]
    given += [f"get {name}() {{ return {module.exports[name]}; }}" for name in sorted(live)]
    first = _give(module, [_pair(name, module.exports[name]) for name in sorted(early)])
    return f"{first}{taken}{module.text}\n{_give(module, given)}"


def _give(module: Module, names: list[str]) -> str:
    if not names:
        return ""
    scope, given = f"$m.{module.key}", f"{{ {', '.join(names)} }}"
    if any(name.startswith("get ") for name in names):  # Object.assign would read them once
        return f"Object.defineProperties({scope}, Object.getOwnPropertyDescriptors({given}));\n"
    return f"Object.assign({scope}, {given});\n"


def _taken(taken: Import, module: Module, origin: Module, done: bool) -> str:
    """Return the constants of an import. In a cycle the other module has not run: its functions come late."""
    scope = f"$m.{origin.key}"
    lines = [f"const {taken.whole} = {scope};\n"] if taken.whole else []
    if done and taken.names:
        lines.append(
            f"const {{ {', '.join(_pair(there, here) for there, here in taken.names)} }} = {scope};\n"
        )
        return "".join(lines)
    for there, here in taken.names:
        if origin.exports[there] not in origin.functions:
            raise AssetError(
                f"{module.name}:{taken.line} imports {there} of {origin.name}, which imports {module.name}: "
                "in a cycle only functions can be."
            )
        lines.append(f"const {here} = (...given) => {scope}.{there}(...given);\n")
    return "".join(lines)


def _loading(name: str, order: Sequence[str]) -> str:
    """Return the expression in place of `import()`: a promise of what the module exports."""
    if name in order:
        return f"Promise.resolve().then(() => $m.{_key(name)})"
    return f'$load("{_key(name)}")'


def _pair(there: str, here: str) -> str:
    return here if there == here else f"{there}: {here}"


def _key(name: str) -> str:
    return name.removesuffix(".js").replace("-", "_")
