"""The text and the signal files of a scenario that is written from a model and a measurement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ..data.files import write_whole
from ..scenario.model_parts import Parameters

Value = float | bool | str
DamperText = Callable[[Parameters], str]
"""Parameters that the scenario knows to the table of its damper."""


def signal_file(
    time: NDArray[Any], values: NDArray[Any], title: str, unit: str, path: Path
) -> Path:
    """Write a signal over its times as a two-column CSV; return its path.

    Parameters
    ----------
    time, values : (n,) s, and the signal in its unit
    title, unit : of its column
    path : of the file
    """
    rows = [f"time [s],{title} [{unit}]"]
    rows += [f"{t:.12g},{value!r}" for t, value in zip(time.tolist(), values.tolist(), strict=True)]
    write_whole(path, "\n".join(rows) + "\n")
    return path


def part_text(name: str, source: Mapping[str, Any], parameters: Mapping[str, Value]) -> str:
    """Return the table of a component.

    Parameters
    ----------
    name : of the component
    source : what it is made from: `fmu` or `law`, `building`, `effects` ...
    parameters : the values that it is given
    """
    lines = [f"[components.{name}]", *(f"{key} = {_text(value)}" for key, value in source.items())]
    if parameters:
        pairs = [f"{_text(key)} = {_text(value)}" for key, value in parameters.items()]
        lines.append(f"parameters = {{ {', '.join(pairs)} }}")
    return "\n".join(lines)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_text, value))}]"
    if isinstance(value, str | Path):
        plain = str(value).replace("\\", "\\\\").replace('"', '\\"')
        return f'"{plain}"'
    return repr(float(value))


def scenario_text(
    head: tuple[str, str], run: tuple[float, float], parts: list[str], wires: Mapping[str, str]
) -> str:
    """Return the text of a scenario.

    Parameters
    ----------
    head : its title, and the comment above
    run : stop and step [s]
    parts : the components' tables
    wires : input to output, both "component.port"
    """
    title, about = head
    plain = title.replace("\\", "/").replace('"', "'")
    text = f'{about}\n\nschema = 1\ntitle = "{plain}"\n\n[run]\nstop = {run[0]!r}\n'
    text += f'step = {run[1]!r}\nalgorithm = "gauss-seidel"\n'
    # A SignalSource names no unit. Its file holds that of the input: a factor says so to the check.
    lines = [
        f'"{target}" = {{ from = "{source}", factor = 1.0 }}'
        if source.endswith(".value")
        else f'"{target}" = "{source}"'
        for target, source in wires.items()
    ]
    return "\n".join([text, "\n\n".join(parts), "\n[connections]", *lines]) + "\n"
