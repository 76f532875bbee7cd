"""List components, their ports, records, stock scenarios and effects."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..quantity import typed

if TYPE_CHECKING:
    from ..fmu.description import Description, Variable

HELP = "list components, ports, records, scenarios, effects"

_TOPICS = ("components", "ports", "records", "scenarios", "effects")
_UNITS = {"peak": "m/s2", "duration": "s"}
Rows = list[dict[str, Any]]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle list`."""
    parser.add_argument(
        "topic", nargs="?", choices=_TOPICS, help="what to list; everything but ports by default"
    )
    parser.add_argument("name", nargs="?", help="with ports: a component, or the path of an FMU")
    parser.add_argument(
        "--building", type=Path, metavar="FILE", help="with ports Structure: a building's data file"
    )
    parser.add_argument("--json", action="store_true", help="print as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Print the lists that were asked for."""
    from ..errors import ScenarioError

    topic, name = arguments.topic, arguments.name
    if topic == "ports" and not name:
        raise ScenarioError("list ports wants a name, e.g. bristle list ports LuGreDamper.")
    if topic != "ports" and (name or arguments.building):
        raise ScenarioError(f'list {topic or ""}: only "list ports" takes a name or a building.')
    tables: dict[str, Rows] = {}
    if topic in (None, "components"):
        tables["components"] = _components()
    if topic == "ports":
        tables["ports"] = _ports(name, arguments.building)
    if topic in (None, "records"):
        tables["records"] = _records()
    if topic in (None, "scenarios"):
        tables["scenarios"] = _scenarios()
    if topic in (None, "effects"):
        tables["effects"] = _effects()
    if arguments.json:
        import json

        print(json.dumps(tables[topic] if topic else tables, indent=2))
        return 0
    for title, rows in tables.items():
        _print(title, rows)
    return 0


def _components() -> Rows:
    from ..fmu import catalogue

    names = catalogue.component_names()
    return [{"name": name, "description": catalogue.describe(name).description} for name in names]


def _describe(name: str, building: Path | None) -> Description:
    """Return the description of a built-in component or of an FMU file."""
    from ..errors import ScenarioError
    from ..findings import unknown
    from ..fmu import catalogue
    from ..fmu.description import read_description

    if building and name != "Structure":
        raise ScenarioError("list ports: --building goes with Structure alone.")
    names = catalogue.component_names()
    if name in names:
        return catalogue.describe(name, building)
    if name.lower().endswith(".fmu") or Path(name).is_file():
        return read_description(Path(name))
    raise ScenarioError(f"list ports: {unknown('component', name, names)}")


def _ports(name: str, building: Path | None) -> Rows:
    description = _describe(name, building)
    return [
        _port(variable)
        for causality in ("input", "output", "parameter")
        for variable in description.of(causality)
    ]


def _port(variable: Variable) -> dict[str, Any]:
    return {
        "name": variable.name,
        "causality": variable.causality + (" (optional)" if variable.optional else ""),
        "type": variable.kind,
        "unit": variable.unit,
        "start": None if variable.causality == "output" else variable.start,
        "minimum": variable.minimum,
        "maximum": variable.maximum,
        "description": variable.description,
    }


def _records() -> Rows:
    from dataclasses import asdict

    from ..data import list_ground_motions

    return [asdict(row) for row in list_ground_motions()]


def _scenarios() -> Rows:
    from ..core.config import toml_content
    from ..scenario.scenario import stock_scenarios

    rows = []
    for file in stock_scenarios():
        title = toml_content(file).get("title", file.stem)
        rows.append({"name": file.stem, "title": title, "file": str(file)})
    return rows


def _effects() -> Rows:
    from ..physics import effects as _registered  # noqa: F401  (importing registers them)
    from ..physics.effect import EFFECTS

    return [
        {"name": name, "site": ", ".join(effect.sites), "description": effect.first_line()}
        for name, effect in sorted(EFFECTS.items())
    ]


def _print(title: str, rows: Rows) -> None:
    """Print one table: with rules on a terminal, plain columns in a pipe."""
    columns = [
        column
        for column in (rows[0] if rows else {})
        if any(row[column] not in (None, "") for row in rows)
    ]
    heads = [f"{column} [{_UNITS[column]}]" if column in _UNITS else column for column in columns]
    cells = [[_cell(row[column]) for column in columns] for row in rows]
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table

        table = Table(title=title, title_justify="left")
        # Text, not markup: units in brackets are no styles.
        for head in heads:
            table.add_column(head.replace("[", r"\["))
        for row in cells:
            table.add_row(*(cell.replace("[", r"\[") for cell in row))
        Console().print(table if rows else f"{title}: none")
        return
    print(title if rows else f"{title}: none")
    if rows:
        cells.insert(0, heads)
    widths = [max(len(row[i]) for row in cells) for i in range(len(columns))]
    for row in cells:
        line = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        print(f"  {line}".rstrip())


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return typed(value) if isinstance(value, float) else str(value)
