"""The API's page, made from docstrings: signature, sections and example of every public name."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Mapping
from typing import Any

import bristle

ORDER = (
    "run", "load_results", "ensemble", "compare_controllers", "design", "identify", "compare",
    "diagnose", "plan", "Study",
    "Results", "Ensemble", "DesignResult", "Identified", "Comparison", "Diagnosis", "Plan",
    "Measurement",
    "Effect", "Law", "Parameter", "BristleError",
)  # fmt: skip
"""The public names in the order in which they are used."""

_HEADING = re.compile(r"^(?P<title>[A-Z][\w ]+)\n-{3,}$", re.MULTILINE)
_NAMES = re.compile(r"\*{0,2}[\w.]+(, \*{0,2}[\w.]+)*|\w+ of [\w ]+")
"""What an entry of a section begins with: names, or of Returns a type such as "list of Step"."""

_INTRO = """# API reference

```python
import bristle
```

`dir(bristle)` lists what is here. Each name is imported on first use. Everything is typed; errors
derive from `bristle.BristleError` and say where, what, and what would be right. In a notebook,
results, comparisons, verdicts, studies and fits show themselves as a table and a picture; their
`plot()` returns a matplotlib figure, which is neither shown nor kept elsewhere.

In signatures `Data` is a path, a pattern such as `"lab/*.csv"`, a pandas frame, a mapping of
channels to arrays, a `Measurement`, or several of these; `Given` a law's name, the path of a
model.toml, or a model; `Channels` a mapping such as `{"force": "-Ch3@kN"}`.
"""


def api_page() -> str:
    """Return the page of the public names."""
    # Ids of their own: `ensemble` and `Ensemble` would share one.
    rows = [(f"[`{name}`](#{name})", _summary(getattr(bristle, name))) for name in ORDER]
    table = _table(("name", "what it is"), rows)
    return "\n\n".join([_INTRO.strip(), table, *map(_part, ORDER)]) + "\n"


def sections(text: str) -> dict[str, str]:
    """Return a docstring's sections by title; what stands before the first is "" ."""
    places = list(_HEADING.finditer(text))
    found = {"": text[: places[0].start()] if places else text}
    for place, after in zip(places, [*places[1:], None], strict=True):
        found[place["title"]] = text[place.end() : after.start() if after else None]
    return {title: body.strip("\n").rstrip() for title, body in found.items()}


def entries(body: str) -> tuple[list[tuple[str, str, str]], str]:
    """Return (name, type, text) of a section's entries, and the prose that stands between them."""
    found: list[tuple[str, str, list[str]]] = []
    prose: list[str] = []
    for line in body.splitlines():
        name, _, kind = line.partition(" : ")
        if line.startswith(" ") and found:
            found[-1][2].append(line.strip())
        elif _NAMES.fullmatch(name.strip()):
            found.append((name.strip(), kind.strip(), []))
        else:
            prose.append(line.strip())
    return [(name, kind, " ".join(filter(None, text))) for name, kind, text in found], " ".join(
        filter(None, prose)
    )


def _part(name: str) -> str:
    thing = getattr(bristle, name)
    parts = [f"## {name} {{ #{name} }}"]
    if not inspect.isclass(thing):
        parts.append(f"```python\n{signature(name, thing)}\n```")
    found = sections(inspect.getdoc(thing) or "")
    parts.append(_plain(found.pop("")))
    for title, body in found.items():
        parts.append(f"**{title}**")
        if title == "Examples":
            parts.append(f"```pycon\n{body}\n```")
        else:
            parts.append(_section(title, body))
    if inspect.isclass(thing):
        methods = _methods(thing)
        if methods:
            parts += ["**Methods**", _table(("method", "what it does"), methods)]
    return "\n\n".join(parts)


def signature(name: str, function: Any) -> str:
    """Return a function's signature, one argument a line."""
    found = inspect.signature(function)
    lines, keyword = [], False
    for parameter in found.parameters.values():
        if parameter.kind is parameter.KEYWORD_ONLY and not keyword:
            lines.append("*,")
            keyword = True
        default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
        lines.append(f"{parameter.name}: {parameter.annotation}{default},")
    inner = textwrap.indent("\n".join(lines), "    ")
    return f"bristle.{name}(\n{inner}\n) -> {found.return_annotation}"


def _section(title: str, body: str) -> str:
    listed, prose = entries(body)
    if any(kind for _, kind, _ in listed):
        titles = ("name", "type", "meaning")
        table = _table(titles, [(f"`{name}`", kind, text) for name, kind, text in listed])
    else:
        first = {"Returns": "type", "Raises": "error"}.get(title, "name")
        table = _table((first, "meaning"), [(f"`{name}`", text) for name, _, text in listed])
    return "\n\n".join(filter(None, [table if listed else "", prose]))


def _methods(thing: type) -> list[tuple[str, str]]:
    """Return the documented public methods and properties of a class, its own ones alone."""
    rows = []
    for name, member in vars(thing).items():
        if name.startswith("_"):
            continue
        function = member.fget if isinstance(member, property) else member
        function = getattr(function, "__func__", getattr(function, "func", function))
        text = inspect.getdoc(function) if inspect.isfunction(function) else ""
        if text:
            shown = f"`{name}`" if isinstance(member, property) else f"`{name}()`"
            rows.append((shown, text.split("\n\n")[0].replace("\n", " ")))
    return rows


def _summary(thing: Any) -> str:
    return (inspect.getdoc(thing) or "").split("\n\n")[0].replace("\n", " ")


def _plain(text: str) -> str:
    return textwrap.dedent(text).strip("\n")


def _table(titles: tuple[str, ...], rows: list[Any]) -> str:
    lines = [titles, ["---"] * len(titles), *rows]
    return "\n".join(
        "| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in lines
    )


def documented() -> Mapping[str, dict[str, str]]:
    """Return the sections of every public name's docstring."""
    return {name: sections(inspect.getdoc(getattr(bristle, name)) or "") for name in ORDER}
