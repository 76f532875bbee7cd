"""Effects of a user's own: files that are read, refused with a reason, or registered.

A hook must be a pure function of `q`, `z`, `p`, for it runs in FMUs, under numba and inside fits.
So a file is read before it runs: what it may name is listed here, and a clock, a file or chance is
not in the list. That keeps hooks pure; against harm stands consent (`bristle.trust`), which is
asked for before any text runs. What cannot be read from the text (a value that is not finite, a
jump) is found by calling the hooks.
"""

from __future__ import annotations

import ast
import hashlib
import math
import re
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from .. import units
from ..errors import PhysicsError, TrustError, UnitError
from . import damper, structure
from .effect import EFFECTS, HOOKS, Effect, Q
from .probe import FlawError, probe

PACKAGE = "bristle_own_effects"
_OFFERED = ("Effect", "Parameter", "Table", "interpolate")
_MODULES = {"math": set(dir(math)), "bristle.physics.effect": set(_OFFERED)}
_BUILTINS = {"abs", "min", "max", "float", "int", "bool", "round", "range", "dict", "tuple", "str"}
_BUILTINS |= {"staticmethod", "True", "False", "None", "__name__"}
_REFUSED = {
    ast.While: "a loop may not end",
    ast.For: "a loop has no place in a hook",
    ast.AsyncFor: "a loop has no place in a hook",
    ast.Global: "it would remember something outside its states",
    ast.Nonlocal: "it would remember something outside its states",
    ast.Yield: "it would remember something outside its states",
    ast.YieldFrom: "it would remember something outside its states",
    ast.Await: "there is nothing to wait for",
    ast.With: "there is nothing to open",
    ast.AsyncWith: "there is nothing to open",
    ast.Try: "an error must show",
    ast.Delete: "there is nothing to delete",
    ast.AsyncFunctionDef: "there is nothing to wait for",
    ast.Lambda: "a function with def and a name is right",
    ast.NamedExpr: "an assignment of its own is right",
}
_CONTAINERS = (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.SetComp)


@dataclass(frozen=True)
class Loaded:
    """A file with an effect: the effect, or in `error` why it is left out, with file and line."""

    path: Path
    effect: type[Effect] | None
    error: str = ""

    @property
    def name(self) -> str:
        """The effect's name, which is the file's too."""
        return self.path.stem


_known: dict[Path, tuple[str, Loaded]] = {}  # by file: digest of its text, and what came of it
_waiting: dict[Path, TrustError] = {}  # by file: why its code may not run yet


def _nobody(path: Path, text: str) -> None:
    """Refuse: nobody was asked whether a text may run."""
    raise TrustError(path, text)


_require: Callable[[Path, str], None] = _nobody


def ask_before_running(require: Callable[[Path, str], None]) -> None:
    """Set what is called with file and text before any code of a user runs.

    It raises TrustError where the code must not run; until it is set, none does.
    """
    global _require
    _require = require


def load_effects(folder: Path) -> list[Loaded]:
    """Return the effects of a folder's files, registered, and those that are left out.

    Read again, an unchanged file costs nothing; a changed one replaces its effect, and one that is
    gone takes it away. A bad file never raises: its `error` says where and why.
    """
    files = sorted(folder.glob("*.py")) if folder.is_dir() else []
    here = {path.resolve() for path in files}
    gone = [path for path in _known if path.parent == folder.resolve() and path not in here]
    changed = any(_forget(path) for path in gone)
    found = []
    for path in files:
        loaded, new = _load(path.resolve(), path)
        found.append(loaded)
        changed = changed or new
    if changed:
        _regenerate()
    return found


def load_effect(path: Path) -> type[Effect]:
    """Return the effect of one file, registered.

    Raises
    ------
    PhysicsError
        If there is no such file or it is not right: with file and line.
    TrustError
        If its code must not run yet.
    """
    if not path.is_file():
        raise PhysicsError(f"{path}: there is no such file with an effect.")
    loaded, new = _load(path.resolve(), path)
    if new:
        _regenerate()
    if path.resolve() in _waiting:
        raise _waiting[path.resolve()]
    if loaded.effect is None:
        raise PhysicsError(loaded.error)
    return loaded.effect


def own_effects() -> dict[str, Path]:
    """Return the files of the users' effects that are registered, by name."""
    good = {one.name: path for path, (_, one) in _known.items() if one.effect is not None}
    return dict(sorted(good.items()))


def why_left_out(path: Path) -> str:
    """Return why a file's effect was left out; "" where it was not, or was never read."""
    known = _known.get(path.resolve())
    return known[1].error if known else ""


def waiting(path: Path) -> TrustError | None:
    """Return why a file's code may not run yet; None where it may, or was never read."""
    return _waiting.get(path.resolve())


def leave_out(effect: type[Effect], why: str) -> None:
    """Take an effect of a user's out of the library, for a reason that was found later."""
    for path, (digest, loaded) in list(_known.items()):
        if loaded.effect is effect:
            _forget(path)
            _known[path] = digest, Loaded(loaded.path, None, why)
    _regenerate()


def unload_effects() -> None:
    """Take every effect of a user's out of the library: it is as it came."""
    _waiting.clear()
    gone = [_forget(path) for path in list(_known)]
    if any(gone):
        _regenerate()


def _regenerate() -> None:
    damper.regenerate()
    structure.regenerate()


def _forget(path: Path) -> bool:
    """Drop what a file gave; return whether an effect went with it."""
    _, loaded = _known.pop(path)
    if loaded.effect is not None and EFFECTS.get(loaded.name) is loaded.effect:
        del EFFECTS[loaded.name]
        return True
    return False


def _load(path: Path, shown: Path) -> tuple[Loaded, bool]:
    """Return what a file gives, and whether the library has changed."""
    _waiting.pop(path, None)
    try:
        if not path.is_file():  # a folder, or a pipe, which would be read for ever
            raise OSError("it is no file")
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        return Loaded(shown, None, f"{shown}: cannot be read ({error})."), False
    digest = hashlib.sha256(text.encode()).hexdigest()
    known = _known.get(path)
    if known is not None and known[0] == digest:
        effect = known[1].effect
        if effect is None or EFFECTS.get(effect.name) is effect:
            return known[1], False
    changed = path in _known and _forget(path)
    try:
        _require(shown, text)
    except TrustError as error:
        _waiting[path] = error
        return Loaded(shown, None, str(error)), changed
    try:
        effect = _made(text, path, shown)
    except FlawError as flaw:
        where = f"{shown}, line {flaw.line}" if flaw.line else f"{shown}"
        loaded = Loaded(shown, None, f"{where}: {flaw}")
    else:
        loaded, changed = Loaded(shown, effect), True
    _known[path] = digest, loaded
    return loaded, changed


def _made(text: str, path: Path, shown: Path) -> type[Effect]:
    """Return the effect that a file's text defines, registered; FlawError if it is not right."""
    try:
        tree = ast.parse(text, str(shown), feature_version=(3, 9))
    except SyntaxError as error:
        raise FlawError(f"this is no Python: {error.msg}.", error.lineno or 0) from None
    except ValueError as error:  # a null byte
        raise FlawError(f"this is no Python: {error}.") from None
    _refuse_coding(text)
    _read(tree)
    other = EFFECTS.get(path.stem)
    if other is not None and other.own:  # of another folder: the one that is read last stays
        _forget(next(p for p, (_, one) in _known.items() if one.effect is other))
    folder = hashlib.sha256(str(path.parent).encode()).hexdigest()[:8]
    module = ModuleType(f"{PACKAGE}.{folder}.{path.stem}")
    module.__file__ = str(path)
    module.__package__ = "bristle.physics.effects"
    before = dict(EFFECTS)
    sys.modules[module.__name__] = module
    try:
        exec(compile(tree, str(path), "exec"), module.__dict__)
        effect = _only_one(module, path, tree)
        _check(effect, tree)
        probe(effect)
    except BaseException as error:
        EFFECTS.clear()
        EFFECTS.update(before)
        if isinstance(error, FlawError):
            raise
        if not isinstance(error, Exception):
            raise
        raise FlawError(_said(error), _line(error, path)) from None
    effect.own = True
    return effect


def _refuse_coding(text: str) -> None:
    """Refuse a text that Python would read in another coding than it was shown in."""
    for number, line in enumerate(text.splitlines()[:2], 1):
        named = re.match(r"[ \t\f]*#.*?coding[:=][ \t]*([-\w.]+)", line)
        if named and named[1].lower().replace("_", "-") not in ("utf-8", "utf8"):
            raise FlawError(f"coding {named[1]}; utf-8 is right.", number)


def _said(error: Exception) -> str:
    if isinstance(error, PhysicsError):
        return str(error)
    return f"it raises {type(error).__name__}: {error}."


def _line(error: Exception, path: Path) -> int:
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame.lineno for frame in frames if frame.filename == str(path)]
    return (own[-1] or 0) if own else 0


def _only_one(module: ModuleType, path: Path, tree: ast.Module) -> type[Effect]:
    """Return the one effect of a module, whose name is the file's."""
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Effect) and value is not Effect
        if value.__module__ == module.__name__ and value.name
    ]
    lines = [node.lineno for node in tree.body if isinstance(node, ast.ClassDef)]
    if len(found) != 1:
        line = lines[1] if len(lines) > 1 else 0
        raise FlawError(
            f"{len(found)} effects are defined; one class Effect with a name is right.", line
        )
    if found[0].name != path.stem:
        raise FlawError(
            f'the effect is named "{found[0].name}" and the file {path.name}; name = "{path.stem}" '
            "is right.",
            lines[0],
        )
    return found[0]


def _check(effect: type[Effect], tree: ast.Module) -> None:
    """Refuse class data that the rest of the package could not work with."""
    line = next(node.lineno for node in tree.body if isinstance(node, ast.ClassDef))
    for name in effect.fields():
        if not name.isidentifier() or name == "on" or name.endswith("_0"):
            raise FlawError(
                f'a parameter cannot be named "{name}"; a word such as "k" is right.', line
            )
    for name, parameter in effect.parameters.items():
        if not all(math.isfinite(bound) for bound in parameter.bounds):
            raise FlawError(f"the bounds of {name}, {parameter.bounds}, must be finite.", line)
    spelled = [p.unit for p in effect.parameters.values()] + list(effect.states.values())
    for unit in spelled:
        try:
            right = units.canonical(unit)
        except UnitError as error:
            raise FlawError(f"{error}", line) from None
        if right != unit:
            raise FlawError(f'unit "{unit}" is spelled "{right}" here.', line)


def _read(tree: ast.Module) -> None:
    """Refuse what a hook must not do, as far as the text shows it."""
    names = set(_BUILTINS) | set(_OFFERED)
    for statement in tree.body:
        names |= _defined(statement)
    for node in ast.walk(tree):
        why = _REFUSED.get(type(node))
        if why:
            raise FlawError(f"{_word(node)}: {why}.", getattr(node, "lineno", 0))
        if isinstance(node, ast.Attribute) and node.attr.startswith("__"):
            raise FlawError(f"{node.attr} has no place here.", node.lineno)
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    ready = set(names) - {function.name for function in functions}
    for function in functions:
        _read_function(function, ready)
        ready.add(function.name)
    inside = {id(node) for function in functions for node in ast.walk(function)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and id(node) not in inside:
            called = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
            if called not in names | {"dict.fromkeys"} and not called.startswith("math."):
                raise FlawError(
                    f"{called}(...) is called; math and plain numbers are right.", node.lineno
                )
    for owner in tree.body:
        if isinstance(owner, ast.ClassDef):
            _read_needs(owner)


def _defined(node: ast.stmt) -> set[str]:
    """Return the names that a statement of the file defines; refuse an import of anything else."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            if alias.name != "math" or alias.asname:
                raise FlawError(_not_pure(alias.name), node.lineno)
        return {"math"}
    if isinstance(node, ast.ImportFrom):
        if node.module == "__future__":
            return set()
        # As the library's own files say it, and as a copy of one still does.
        near = node.level == 2 and node.module == "effect"
        module = "bristle.physics.effect" if near else "" if node.level else node.module or ""
        allowed = _MODULES.get(module, set())
        for alias in node.names:
            if alias.name not in allowed or alias.asname:
                raise FlawError(_not_pure(f"{'.' * node.level}{node.module or ''}"), node.lineno)
        return {alias.name for alias in node.names}
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        return {node.name}
    if isinstance(node, (ast.Assign, ast.AnnAssign)):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        return {name.id for one in targets for name in ast.walk(one) if isinstance(name, ast.Name)}
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return set()
    raise FlawError(
        "imports, constants, functions and one class Effect are right at the top of a file.",
        node.lineno,
    )


def _not_pure(module: str) -> str:
    return (
        f"{module} is imported. A hook is a pure function of q, z and p, without clock, chance or "
        "file: `from math import ...` and `from bristle.physics.effect import Effect, Parameter` "
        "are right."
    )


def _read_function(function: ast.FunctionDef, ready: set[str]) -> None:
    """Refuse containers, memory and unknown names inside a function."""
    spec = function.args
    if spec.defaults or spec.vararg or spec.kwarg or spec.kwonlyargs:
        raise FlawError(
            f"{function.name}: plain arguments without defaults are right.", function.lineno
        )
    local = {argument.arg for argument in spec.args}
    for node in ast.walk(function):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            local.add(node.id)
    for node in ast.walk(function):
        line = getattr(node, "lineno", function.lineno)
        if isinstance(node, _CONTAINERS):
            raise FlawError(
                f"{function.name}: {_word(node)}; a hook knows numbers and tuples.", line
            )
        if isinstance(node, (ast.Attribute, ast.Subscript)) and isinstance(node.ctx, ast.Store):
            raise FlawError(
                f"{function.name}: {ast.unparse(node)} is set; a hook returns what is new "
                "and changes nothing.",
                line,
            )
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and node is not function:
            raise FlawError(f"{function.name}: a definition inside a function.", line)
        known = ready | local
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in known:
            raise FlawError(
                f"{function.name}: {node.id} is not defined above; a hook is a pure function of q, "
                "z and p.",
                line,
            )


def _read_needs(owner: ast.ClassDef) -> None:
    """Refuse signals that a hook reads and `needs` does not name."""
    stated: set[str] | None = None
    for node in owner.body:
        if isinstance(node, ast.Assign) and [ast.unparse(t) for t in node.targets] == ["needs"]:
            try:
                stated = set(ast.literal_eval(node.value))
            except ValueError:
                return
    for hook in (node for node in owner.body if isinstance(node, ast.FunctionDef)):
        if hook.name not in HOOKS:
            continue
        if len(hook.args.args) != 3:
            raise FlawError(f"{hook.name}: a hook takes q, z, p.", hook.lineno)
        if [ast.unparse(decorator) for decorator in hook.decorator_list] != ["staticmethod"]:
            raise FlawError(f"{hook.name}: @staticmethod above it is right.", hook.lineno)
        q = hook.args.args[0].arg
        for inner in ast.walk(hook):
            if isinstance(inner, ast.Attribute) and isinstance(inner.value, ast.Name):
                if inner.value.id == q and inner.attr not in Q._fields:
                    offers = ", ".join(Q._fields)
                    raise FlawError(f"{q} has no {inner.attr}; it offers {offers}.", inner.lineno)
                if inner.value.id == q and inner.attr not in (stated or set()):
                    raise FlawError(
                        f'{hook.name} reads {q}.{inner.attr}: add "{inner.attr}" to needs.',
                        inner.lineno,
                    )


def _word(node: ast.AST) -> str:
    words = {"AsyncFor": "async for", "NamedExpr": ":=", "ListComp": "a list", "Dict": "a dict"}
    words |= {"List": "a list", "Set": "a set", "SetComp": "a set", "DictComp": "a dict"}
    return words.get(type(node).__name__, type(node).__name__.lower())
