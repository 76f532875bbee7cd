"""What the text of a user's file may say: read before anything of it runs.

A hook must be a pure function of `q`, `z`, `p`, for it runs in FMUs, under numba and inside fits.
What it may name is listed here, and a clock, a file, the network or chance is not in the list.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

from ..physics.effect import FIELDS as OF_EFFECTS
from ..physics.effect import HOOKS, Q
from ..physics.law import ALL_HOOKS
from ..physics.law import FIELDS as OF_LAWS


class FlawError(Exception):
    """What is wrong with a user's effect or law, and the line where."""

    def __init__(self, text: str, line: int = 0) -> None:
        super().__init__(text)
        self.line = line


def text_of(path: Path, errors: str = "strict") -> str:
    """Return the text of a user's file, to which consent is given; no mark of its encoding counts.

    Editors of Windows put a byte order mark before it. A text read with it would be another one.

    Parameters
    ----------
    path : the file
    errors : what becomes of bytes that are no UTF-8, as `open` takes it

    Raises
    ------
    OSError, UnicodeDecodeError
        If the file cannot be read.
    """
    return path.read_text(encoding="utf-8-sig", errors=errors)


class Dialect(NamedTuple):
    """What a kind of file may say.

    `word` is what the file defines, `base` its class; `modules` are those that it may import from,
    each with what; `hooks` those of the kind, `data` its class data, `signals` what `q` of a hook
    offers; `needs` says whether the class lists the signals that its hooks read.
    """

    word: str
    base: str
    modules: Mapping[str, tuple[str, ...]]
    hooks: tuple[str, ...]
    data: tuple[str, ...]
    signals: tuple[str, ...]
    needs: bool

    def offered(self) -> set[str]:
        """Return all names that the file may import."""
        return {name for names in self.modules.values() for name in names}


EFFECT = Dialect(
    "effect",
    "Effect",
    {"bristle.physics.effect": ("Effect", "Parameter", "Table", "bilinear", "interpolate")},
    HOOKS,
    (*OF_EFFECTS, "label_span", "in_words", "tie", "yield_share"),
    Q._fields,
    needs=True,
)
_OF_LAWS = ("Law", "Parameter", "Shape", "Table", "Variant", "bilinear", "interpolate")
_FORMS = ("Constant", "Linear", "Monotone", "Quadratic", "Rising")
LAW = Dialect(
    "law",
    "Law",
    {
        "bristle.physics.law": (*_OF_LAWS, *_FORMS),
        # As the library's own files say it, and as a copy of one still does.
        "bristle.physics.command": _FORMS,
        "bristle.physics.parameter": ("Parameter", "Table", "bilinear", "interpolate"),
        "bristle.physics.falling": ("EXPONENT", "STANDARD", "falling"),
    },
    ALL_HOOKS,
    tuple(OF_LAWS),
    ("x", "v", "a", "V", "dt", "energy"),
    needs=False,
)
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
_NEAR = 0.8  # how alike a name is that is misspelled
_CONTAINERS = (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.SetComp)


def read(tree: ast.Module, dialect: Dialect) -> None:
    """Refuse what a file must not do, as far as the text shows it.

    Raises
    ------
    FlawError
        With the line.
    """
    names = set(_BUILTINS) | dialect.offered()
    for statement in tree.body:
        names |= _defined(statement, dialect)
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
            _refuse_misspelled(owner, dialect)
            _read_hooks(owner, dialect)


def _defined(node: ast.stmt, dialect: Dialect) -> set[str]:
    """Return the names that a statement of the file defines; refuse an import of anything else."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            if alias.name != "math" or alias.asname:
                raise FlawError(_not_pure(alias.name, dialect), node.lineno)
        return {"math"}
    if isinstance(node, ast.ImportFrom):
        if node.module == "__future__":
            return set()
        near = f"bristle.physics.{node.module}"  # as the library's own files say it
        module = near if node.level == 2 else "" if node.level else node.module or ""
        allowed = set(dir(math)) if module == "math" else set(dialect.modules.get(module, ()))
        for alias in node.names:
            if alias.name not in allowed or alias.asname:
                shown = f"{'.' * node.level}{node.module or ''}"
                raise FlawError(_not_pure(shown, dialect), node.lineno)
        return {alias.name for alias in node.names}
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        return {node.name}
    if isinstance(node, (ast.Assign, ast.AnnAssign)):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        return {name.id for one in targets for name in ast.walk(one) if isinstance(name, ast.Name)}
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return set()
    raise FlawError(
        f"imports, constants, functions and one class {dialect.base} are right at the top of a "
        "file.",
        node.lineno,
    )


def _not_pure(module: str, dialect: Dialect) -> str:
    return (
        f"{module} is imported. A hook is a pure function of q, z and p, without clock, chance, "
        f"file or network: `from math import ...` and `from {next(iter(dialect.modules))} import "
        f"{dialect.base}, Parameter` are right."
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


def _refuse_misspelled(owner: ast.ClassDef, dialect: Dialect) -> None:
    """Refuse what is nearly the name of class data or of a hook: nothing would read it."""
    known = (*dialect.hooks, *dialect.data)
    for node in owner.body:
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        named = [one.id for one in targets if isinstance(one, ast.Name)]
        named += [node.name] if isinstance(node, ast.FunctionDef) else []
        for name in named:
            near = get_close_matches(name, known, n=1, cutoff=_NEAR)
            if near and name not in known:
                raise FlawError(
                    f'nothing reads "{name}": "{near[0]}" is right, or a name that is not alike.',
                    node.lineno,
                )


def _stated_needs(owner: ast.ClassDef) -> set[str] | None:
    """Return the signals that `needs` names; None where that cannot be read from the text."""
    for node in owner.body:
        if isinstance(node, ast.Assign) and [ast.unparse(t) for t in node.targets] == ["needs"]:
            try:
                return set(ast.literal_eval(node.value))
            except (ValueError, TypeError):  # no constant; the class itself is asked later
                return None
    return set()


def _read_hooks(owner: ast.ClassDef, dialect: Dialect) -> None:
    """Refuse signals that do not exist, or that a hook reads and `needs` does not name."""
    stated = _stated_needs(owner) if dialect.needs else set(dialect.signals)
    if stated is None:
        return
    for hook in (node for node in owner.body if isinstance(node, ast.FunctionDef)):
        if hook.name not in dialect.hooks:
            continue
        if len(hook.args.args) != 3:
            raise FlawError(f"{hook.name}: a hook takes q, z, p.", hook.lineno)
        if [ast.unparse(decorator) for decorator in hook.decorator_list] != ["staticmethod"]:
            raise FlawError(f"{hook.name}: @staticmethod above it is right.", hook.lineno)
        q = hook.args.args[0].arg
        for inner in ast.walk(hook):
            if isinstance(inner, ast.Attribute) and isinstance(inner.value, ast.Name):
                if inner.value.id == q and inner.attr not in dialect.signals:
                    offers = ", ".join(dialect.signals)
                    raise FlawError(f"{q} has no {inner.attr}; it offers {offers}.", inner.lineno)
                if inner.value.id == q and inner.attr not in stated:
                    raise FlawError(
                        f'{hook.name} reads {q}.{inner.attr}: add "{inner.attr}" to needs.',
                        inner.lineno,
                    )


def _word(node: ast.AST) -> str:
    words = {"AsyncFor": "async for", "NamedExpr": ":=", "ListComp": "a list", "Dict": "a dict"}
    words |= {"List": "a list", "Set": "a set", "SetComp": "a set", "DictComp": "a dict"}
    return words.get(type(node).__name__, type(node).__name__.lower())
