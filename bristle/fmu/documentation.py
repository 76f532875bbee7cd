"""What an FMU shows a person: an icon, its licence, and a page with ports, equation and sources."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from inspect import getdoc
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element

from ..core.files import licence_file
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from . import catalogue
from .component import SWITCH
from .description import Variable, describe

if TYPE_CHECKING:
    from .build import BuildPlan

_ICONS = Path(__file__).resolve().parent / "icons"
_STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left;"
    "vertical-align:top}pre{background:#f4f4f4;padding:.6em;overflow:auto}"
)
_TERMINALS = """<?xml version="1.0" encoding="UTF-8"?>
<fmiTerminalsAndIcons fmiVersion="3.0">
  <GraphicalRepresentation>
    <CoordinateSystem x1="-100" y1="-100" x2="100" y2="100" suggestedScalingFactorTo_mm="0.1"/>
    <Icon x1="-100" y1="-100" x2="100" y2="100"/>
  </GraphicalRepresentation>
</fmiTerminalsAndIcons>
"""


def sources() -> list[Path]:
    """Return the files that decide what FMUs show besides what they compute."""
    return [Path(__file__), licence_file(), *sorted(_ICONS.iterdir())]


def members(root: Element, what: BuildPlan) -> dict[str, bytes]:
    """Return what goes into an FMU's archive for a person to see, by its path there.

    Parameters
    ----------
    root : Element
        The model description, of FMI 2.0 or 3.0.
    what : BuildPlan
        What is built.
    """
    kind = catalogue.component_class(what.component)
    icon = (_ICONS / f"{kind.icon}.png").read_bytes()
    found = {
        "documentation/index.html": _page(root, kind, what).encode(),
        "documentation/licenses/license.txt": licence_file().read_bytes(),
    }
    if root.get("fmiVersion") == "2.0":
        return {**found, "model.png": icon}
    folder = "terminalsAndIcons"
    return {
        **found,
        f"{folder}/icon.png": icon,
        f"{folder}/terminalsAndIcons.xml": _TERMINALS.encode(),
    }


def _page(root: Element, kind: Any, what: BuildPlan) -> str:
    """Return the page about an FMU."""
    about = describe(root)
    name = escape(root.get("modelName", ""))
    parameters = about.of("parameter")
    on = [one.name.split(".")[-2] for one in parameters if one.name.endswith(SWITCH)]
    effects = [EFFECTS[one] for one in dict.fromkeys(on) if one in EFFECTS]
    law = LAWS.get(getattr(kind, "law", ""))
    lines = [
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
        f"<title>{name}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{name}</h1><p>{escape(about.description)}</p>",
    ]
    if law is not None:
        lines += [f"<h2>Equation: the law {escape(law.name)}</h2>", *_text(getdoc(law) or "")]
    else:
        lines += _text("\n".join((getdoc(kind) or "").split("\n")[1:]))
    if files := [*what.files]:
        lines.append(f"<p>Files inside: {escape(', '.join(files))}.</p>")
    lines += ["<h2>Inputs</h2>", _ports(about.of("input"))]
    lines += ["<h2>Outputs</h2>", _ports(about.of("output"))]
    lines += ["<h2>Parameters</h2>", _parameters(parameters)]
    if parameters:
        lines.append("<p>All are fixed: what is set after the initialisation has no effect.</p>")
    for effect in effects:
        title = f"<h2>Effect: {escape(effect.name.replace('_', ' '))}</h2>"
        lines += [title, *_text(getdoc(effect) or "")]
    sources = {one.name: one.source for one in ([law] if law else []) + effects}
    if sources:
        items = "".join(f"<li>{escape(f'{key}: {text}')}</li>" for key, text in sources.items())
        lines += ["<h2>Sources</h2>", f"<ul>{items}</ul>"]
    origin = [root.get(key, "") for key in ("generationTool", "copyright", "license")]
    lines.append(f"<p>Made by {escape('. '.join(origin))}.</p></body></html>")
    return "\n".join(lines) + "\n"


def _text(text: str) -> Iterator[str]:
    """Return paragraphs, and as they stand the blocks that are indented: formulas."""
    for indented, lines in groupby(text.strip().split("\n"), lambda line: line.startswith("    ")):
        block = "\n".join(lines)
        if indented:
            yield f"<pre>{escape(block)}</pre>"
        else:
            yield from (f"<p>{escape(one)}</p>" for one in block.split("\n\n") if one.strip())


def _ports(variables: Sequence[Variable]) -> str:
    rows = []
    for one in variables:
        text = one.description + (" (optional)" if one.optional else "")
        last = one.over_step or ", ".join(one.dependencies or ())
        rows.append([one.name, one.unit or "", text, last])
    title = "over a step" if variables and variables[0].over_step else "follows at once"
    return _table(["name", "unit", "meaning", title], rows)


def _parameters(variables: Sequence[Variable]) -> str:
    rows = []
    for one in variables:
        low, high = ("" if end is None else f"{end:g}" for end in (one.minimum, one.maximum))
        span = f"{low} to {high}" if low or high else ""
        start = f"{one.start:g}" if type(one.start) is float else str(one.start).lower()
        rows.append([one.name, start, one.unit or "", span, one.description])
    return _table(["name", "value", "unit", "range", "meaning"], rows)


def _table(titles: Iterable[str], rows: Sequence[Sequence[str]]) -> str:
    if not rows:
        return "<p>None.</p>"
    head = "".join(f"<th>{escape(one)}</th>" for one in titles)
    body = "\n".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><tr>{head}</tr>\n{body}</table>"
