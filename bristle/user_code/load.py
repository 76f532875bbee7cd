"""Effects and laws of a user's own: files that are read, refused with a reason, or registered.

A file's text is read first (`reading`), then it runs in a child process under a limit of time
(`trial`), where its hooks are called (`probe`, `probe_law`). Only what passes runs here. That
keeps hooks pure; against harm stands consent (`bristle.trust`), which is asked for before any text
runs, in the child too.
"""

from __future__ import annotations

import ast
import hashlib
import math
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from .. import units
from ..errors import PhysicsError, TrustError, UnitError
from ..physics.effect import EFFECTS, Effect, laws_joined
from ..physics.law import LAWS, Law, law_names
from ..physics.parameter import fields_of
from ..trust import granted, require
from . import trial
from .reading import EFFECT, LAW, Dialect, FlawError, read, text_of
from .trial import probe, probe_law

PACKAGE = "bristle_own_effects"

PORTS = (
    "displacement", "velocity", "voltage", "holding_force", "acceleration", "force",
    "dissipated_energy", "stroke_ratio", "outside", "stroke", "v_max", "moving_mass", "fault",
)  # fmt: skip
"""What a damper's component has beside the parameters of its law."""


@dataclass(frozen=True)
class Loaded:
    """A file with an effect or a law: what it made, or in `error` why it is left out, with line."""

    path: Path
    made: Any
    error: str = ""

    @property
    def name(self) -> str:
        """The name of the effect or law, which is the file's too."""
        return self.path.stem


@dataclass(frozen=True)
class _Kind:
    """What differs between a user's effects and laws."""

    dialect: Dialect
    base: type
    known: dict[str, Any]
    others: dict[str, Any]
    package: str
    probe: Callable[[Any], None]


_KINDS = {
    "effect": _Kind(EFFECT, Effect, EFFECTS, LAWS, "bristle.physics.effects", probe),
    "law": _Kind(LAW, Law, LAWS, EFFECTS, "bristle.physics.laws", probe_law),
}
_known: dict[Path, tuple[str, Loaded]] = {}  # by file: digest of its text, and what came of it
_waiting: dict[Path, TrustError] = {}  # by file: why its code may not run yet


def load(folder: Path, word: str = "effect", *, trust: bool = False) -> list[Loaded]:
    """Return the effects or laws of a folder's files, registered, and those that are left out.

    Read again, an unchanged file costs nothing; a changed one replaces what it gave, and one that
    is gone takes it away. A bad file never raises: its `error` says where and why.

    Parameters
    ----------
    folder : it need not exist
    word : "effect" or "law". Load laws first: an effect joins those that are there.
    trust : whether to consent to what they hold. Without it a text that has not run here before is
        left out, and `waiting` says so.

    Raises
    ------
    TrustError
        If consent cannot be kept.
    """
    files = sorted(folder.glob("*.py")) if folder.is_dir() else []
    here = {path.resolve() for path in files}
    for path in [*_known, *_waiting]:
        if path.parent == folder.resolve() and path not in here:
            _forget(path)
    with granted(trust):
        return _load(files, word)


def load_file(path: Path, word: str = "effect", *, trust: bool = False) -> Any:
    """Return the effect or law of one file, registered; parameters as for `load`.

    Raises
    ------
    PhysicsError
        If there is no such file or it is not right: with file and line.
    TrustError
        If nobody consented to its code.
    """
    if not path.is_file():
        raise PhysicsError(f"{path}: there is no such file with {_a(word)}.")
    with granted(trust):
        (loaded,) = _load([path], word)
    if path.resolve() in _waiting:
        raise _waiting[path.resolve()]
    if loaded.made is None:
        raise PhysicsError(loaded.error)
    return loaded.made


def own_effects() -> dict[str, Path]:
    """Return the files of the users' effects that are registered, by name."""
    return _own(Effect)


def own_laws() -> dict[str, Path]:
    """Return the files of the users' laws that are registered, by name."""
    return _own(Law)


def _own(base: type) -> dict[str, Path]:
    made = {one.name: (path, one.made) for path, (_, one) in _known.items() if one.made is not None}
    return {name: path for name, (path, one) in sorted(made.items()) if issubclass(one, base)}


def why_left_out(path: Path) -> str:
    """Return why a file's effect or law was left out; "" where it was not, or was never read."""
    known = _known.get(path.resolve())
    return known[1].error if known else ""


def waiting(path: Path) -> TrustError | None:
    """Return why a file's code may not run yet; None where it may, or was never read."""
    return _waiting.get(path.resolve())


def leave_out(made: Any, why: str) -> None:
    """Take an effect or law of a user's out of the library, for a reason that was found later."""
    for path, (digest, loaded) in list(_known.items()):
        if loaded.made is made:
            _forget(path)
            _known[path] = digest, Loaded(loaded.path, None, why)


def unload_effects() -> None:
    """Take every effect and law of a user's out of the library: it is as it came."""
    for path in [*_known, *_waiting]:
        _forget(path)


@contextmanager
def defined(texts: Mapping[str, str]) -> Iterator[None]:
    """Define effects by name that bristle itself wrote, as long as the context lasts.

    Raises
    ------
    PhysicsError
        If a text is not right, or its name is taken.
    """
    made = []
    try:
        for name, text in texts.items():
            made.append(define(name, text))
        yield
    finally:
        for effect in made:
            if EFFECTS.get(effect.name) is effect:
                undefine(effect.name)


def define(name: str, text: str) -> type[Effect]:
    """Define an effect that bristle itself wrote, until `undefine` takes it away.

    Raises
    ------
    PhysicsError
        If the text is not right, or the name is taken.
    """
    if name in EFFECTS:
        raise PhysicsError(f"effect {name!r}: the name is taken. Another one is right.")
    path = Path(f"{name}.py").absolute()
    try:
        made: type[Effect] = _made(text, path, path, "effect")
    except FlawError as error:
        raise PhysicsError(_where(path, error)) from None
    return made


def undefine(name: str) -> None:
    """Take an effect away that `define` gave."""
    EFFECTS.pop(name, None)


def flaw_of(name: str, text: str) -> str:
    """Return why a text can be no effect's file of a name, "" where it can.

    It runs in a child process, as a file does that is new here.
    """
    path = Path(f"{name}.py")
    flaw = _flaws({path: text}, "effect")[path]
    return "" if flaw is None else str(flaw)


def _forget(path: Path) -> None:
    """Drop what a file gave."""
    _waiting.pop(path, None)
    loaded = _known.pop(path)[1] if path in _known else None
    for registry in (EFFECTS, LAWS):
        if loaded and loaded.made is not None and registry.get(loaded.name) is loaded.made:
            del registry[loaded.name]


def _load(files: list[Path], word: str) -> list[Loaded]:
    """Return what files give."""
    kind, texts, found = _KINDS[word], {}, {}
    for shown in files:
        path = shown.resolve()
        _waiting.pop(path, None)
        try:
            if not path.is_file():  # a folder, or a pipe, which would be read for ever
                raise OSError("it is no file")
            text = text_of(path)
        except (OSError, UnicodeDecodeError) as error:
            found[shown] = Loaded(shown, None, f"{shown}: cannot be read ({error}).")
            continue
        digest = hashlib.sha256(text.encode()).hexdigest()
        known = _known.get(path)
        if known is not None and known[0] == digest:
            made = known[1].made
            if made is None or kind.known.get(known[1].name) is made:
                found[shown] = known[1]
                continue
        _forget(path)
        try:
            require(shown, text)
        except TrustError as error:
            _waiting[path] = error
            found[shown] = Loaded(shown, None, str(error))
        else:
            texts[shown] = text, digest
    flaws = _flaws({shown: text for shown, (text, _) in texts.items()}, word)
    for shown, (text, digest) in texts.items():
        path, flaw, made = shown.resolve(), flaws[shown], None
        if flaw is None:
            try:
                made = _made(text, path, shown, word)
            except FlawError as late:
                flaw = late
        found[shown] = Loaded(shown, made, _where(shown, flaw) if flaw is not None else "")
        _known[path] = digest, found[shown]
    return [found[shown] for shown in files]


def _where(shown: Path, flaw: FlawError) -> str:
    return f"{shown}, line {flaw.line}: {flaw}" if flaw.line else f"{shown}: {flaw}"


def _flaws(texts: dict[Path, str], word: str) -> dict[Path, FlawError | None]:
    """Return what is wrong with files: what the text shows, then what a child finds."""
    found: dict[Path, FlawError | None] = {}
    orders = {}
    for shown, text in texts.items():
        try:
            _parsed(text, shown, word)
        except FlawError as flaw:
            found[shown] = flaw
        else:
            path = str(shown.resolve())
            orders[shown] = {"path": path, "shown": str(shown), "word": word, "text": text}
    if orders:
        found.update(zip(orders, trial.tried(list(orders.values())), strict=False))
    return found


def serve() -> None:
    """Try the files that stand on the standard input; `trial.tried` starts a child for it."""

    def run(order: dict[str, Any]) -> None:
        path, shown = Path(order["path"]), Path(order["shown"])
        made = _made(order["text"], path, shown, order["word"], alone=True)
        _KINDS[order["word"]].probe(made)

    trial.serve(run)


def _parsed(text: str, shown: Path, word: str) -> ast.Module:
    """Return the tree of a file's text; FlawError if it says what it must not."""
    try:
        tree = ast.parse(text, str(shown), feature_version=(3, 9))
    except SyntaxError as error:
        raise FlawError(f"this is no Python: {error.msg}.", error.lineno or 0) from None
    except (ValueError, RecursionError, MemoryError) as error:  # a null byte; far too nested
        raise FlawError(f"this is no Python: {error}.") from None
    _refuse_coding(text)
    read(tree, _KINDS[word].dialect)
    return tree


def _refuse_coding(text: str) -> None:
    """Refuse a text that Python would read in another coding than it was shown in."""
    for number, line in enumerate(text.splitlines()[:2], 1):
        named = re.match(r"[ \t\f]*#.*?coding[:=][ \t]*([-\w.]+)", line)
        if named and named[1].lower().replace("_", "-") not in ("utf-8", "utf8"):
            raise FlawError(f"coding {named[1]}; utf-8 is right.", number)


def _made(text: str, path: Path, shown: Path, word: str, *, alone: bool = False) -> Any:
    """Return the effect or law that a file's text defines, registered; FlawError if not right.

    Where it is read `alone`, the user's own law or effect that it may change is not there.
    """
    kind = _KINDS[word]
    tree = _parsed(text, shown, word)
    other = kind.known.get(path.stem)
    if other is not None and other.own:  # of another folder: the one that is read last stays
        for known in [p for p, (_, one) in _known.items() if one.made is other]:
            _forget(known)
    # Of no folder: machine code names the modules of its functions, and serves every copy of them.
    module = ModuleType(f"{PACKAGE}.{word}.{path.stem}")
    module.__file__ = str(path)
    module.__package__ = kind.package
    before = dict(kind.known)
    sys.modules[module.__name__] = module
    try:
        exec(compile(tree, str(path), "exec"), module.__dict__)
        made = _only_one(module, path, tree, kind)
        _check(made, tree, kind, alone=alone)
    except BaseException as error:
        kind.known.clear()
        kind.known.update(before)
        if isinstance(error, FlawError) or not isinstance(error, Exception):
            raise
        plain = isinstance(error, PhysicsError)
        said = str(error) if plain else f"it raises {type(error).__name__}: {error}."
        raise FlawError(said, _line(error, path)) from None
    made.own = True
    return made


def _line(error: Exception, path: Path) -> int:
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame.lineno for frame in frames if frame.filename == str(path)]
    return (own[-1] or 0) if own else 0


def _a(word: str) -> str:
    return f"an {word}" if word[0] in "aeiou" else f"a {word}"


def _only_one(module: ModuleType, path: Path, tree: ast.Module, kind: _Kind) -> Any:
    """Return the one effect or law of a module, whose name is the file's."""
    word, base = kind.dialect.word, kind.dialect.base
    values: list[Any] = list(vars(module).values())
    found = [
        value
        for value in values
        if isinstance(value, type) and issubclass(value, kind.base) and value is not kind.base
        if value.__module__ == module.__name__ and vars(value).get("name")
    ]
    lines = [node.lineno for node in tree.body if isinstance(node, ast.ClassDef)]
    if len(found) != 1:
        line = lines[1] if len(lines) > 1 else 0
        raise FlawError(
            f"{len(found)} {word}s are defined; one class {base} with a name is right.", line
        )
    made: Any = found[0]
    if made.name != path.stem:
        raise FlawError(
            f'the {word} is named "{made.name}" and the file {path.name}; '
            f'name = "{path.stem}" is right.',
            lines[0],
        )
    return made


def _check(made: Any, tree: ast.Module, kind: _Kind, *, alone: bool) -> None:
    """Refuse class data that the rest of the package could not work with."""
    line = next(node.lineno for node in tree.body if isinstance(node, ast.ClassDef))
    try:
        if kind.base is Effect:
            _check_effect(made, anywhere=alone and bool(made.changes))
        else:
            _check_law(made)
        if made.name in kind.others:
            other = "law" if kind.base is Effect else "effect"
            raise FlawError(f'"{made.name}" is the name of {_a(other)}; take another.')
        for name, parameter in made.parameters.items():
            if not all(math.isfinite(bound) for bound in parameter.bounds):
                raise FlawError(f"the bounds of {name}, {parameter.bounds}, must be finite.")
        spelled = [p.unit for p in made.parameters.values()] + list(made.states.values())
        for unit in spelled:
            right = units.canonical(unit)
            if right != unit:
                raise FlawError(f'unit "{unit}" is spelled "{right}" here.')
            si = units.si_unit(unit)
            if "%" not in unit and units.parse(si).factor != units.parse(unit).factor:
                raise FlawError(f'unit "{unit}": hooks compute in SI units; "{si}" is right.')
    except (FlawError, UnitError) as error:
        raise FlawError(str(error), line) from None


def _check_effect(effect: type[Effect], *, anywhere: bool) -> None:
    for name in effect.fields():
        if not name.isidentifier() or name == "on" or name.endswith("_0"):
            raise FlawError(f'a parameter cannot be named "{name}"; a word such as "k" is right.')
    if effect.site == "damper" and not anywhere and not laws_joined(effect):
        what = "the parts that it acts on ({})".format(", ".join(effect.acts_on))
        what = f'"{effect.changes}", which it changes' if effect.changes else what
        raise FlawError(f"no law has {what}: it would join none.")


def _check_law(law: type[Law]) -> None:
    if law.site != "damper":
        raise FlawError("a law of one's own is a damper's; site = \"damper\" is right.")
    if law.name in [name for name in law_names() if name not in LAWS]:
        raise FlawError(f'"{law.name}" is the name of a law of the library; take another.')
    taken = {*PORTS, *(f"{state}_0" for state in law.states)}
    for name in fields_of(law.parameters, law.tables):
        if not name.isidentifier() or name in taken:
            raise FlawError(f'a parameter cannot be named "{name}"; a word such as "k" is right.')
