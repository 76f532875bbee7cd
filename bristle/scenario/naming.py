"""How a run with overrides is called: its title, and the folder of its results."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.toml_lines import KeyPath
from .document import FILE_PARAMETERS, MADE_FROM

if TYPE_CHECKING:
    from .scenario import Component

LONGEST_NAME = 100
"""Characters of a folder's name."""
_ODD = re.compile(r"[^A-Za-z0-9._+=-]")


def changed_title(components: Iterable[Component], changed: Collection[KeyPath]) -> str:
    """Return the title of a run whose components differ from the file's: what it is made of.

    A file's own title may no longer be true then. Sources (components without inputs) are given
    with all their values, the others with those that were changed.

    Parameters
    ----------
    components : iterable of Component
        As they run.
    changed : collection of key paths
        What overrides have changed, such as ("components", "voltage", "parameters", "level").
    """
    texts = []
    for component in components:
        name = component.path.name if component.path else component.fmu
        paths = [path[2:] for path in changed if path[:2] == ("components", component.name)]
        keys = {str(path[-1]) for path in paths}
        inputs = component.description.of("input")
        values = [
            _pair(component, key, value)
            for key, value in component.parameters.items()
            if key in keys or not inputs
        ]
        for key in MADE_FROM:
            file = getattr(component, key)
            if key in keys and file is not None:
                values.append(f"{key} = {file.name}")
        texts.append(f"{name} ({', '.join(values)})" if values else name)
    if any(path[0] == "connections" for path in changed):
        texts.append("other connections than the file's")
    return ", ".join(texts)


def _pair(component: Component, key: str, value: object) -> str:
    if key in FILE_PARAMETERS:
        return f"{key} = {Path(str(value)).name}"
    unit = component.description.variables[key].unit
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    text = text.lower() if isinstance(value, bool) else text
    return f"{key} = {text}" + (f" {unit}" if unit and unit != "1" else "")


def needs_title(changed: Iterable[KeyPath]) -> bool:
    """Return whether changes may make a file's title untrue: all but those of times and steps."""
    return any(path[0] != "run" and path[2:] != ("step",) for path in changed)


def run_name(file: Path, overrides: Mapping[str, object]) -> str:
    """Return the name of a run: the scenario's, and what overrides make of it.

    Different overrides give different names; where a value cannot be part of a name (a path, a long
    list), digits that stand for all overrides follow.
    """
    pairs = [f"{name}={value}" for name, value in overrides.items()]
    name = "_".join([file.stem, *(_ODD.sub("-", _base(pair)) for pair in pairs)])
    if name == "_".join([file.stem, *pairs]) and len(name) <= LONGEST_NAME:
        return name
    if not pairs:
        return file.stem
    digest = hashlib.sha256("\0".join(pairs).encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{name[: LONGEST_NAME - 9].rstrip('-_.')}-{digest}"


def _base(pair: str) -> str:
    """Return a pair whose value is a path with the file's name alone."""
    name, _, value = pair.partition("=")
    last = re.split(r"[/\\]", value)[-1]
    return f"{name}={last}"
