"""List components, their ports, ground motions, stock scenarios, effects and laws; describe one.

Your own begin with `bristle new`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.text import tick, typed
from ..view.blocks import Table, Text
from ..view.terminal import lines
from ._options import Parser, print_json

if TYPE_CHECKING:
    from ..fmu.description import Description, Variable

HELP = "list components, ports, records, scenarios, effects, laws, or describe one"

_KINDS = ("components", "ports", "records", "scenarios", "effects", "laws")
_UNITS = {"peak": "m/s2", "duration": "s"}
Rows = list[dict[str, Any]]


def add_arguments(parser: Parser) -> None:
    """Add the arguments of `bristle list`."""
    text = "what to list; else everything but ports"
    parser.add_argument("kind", nargs="?", choices=_KINDS, metavar="KIND", help=text)
    text = "with effects, laws: the one to describe; with ports: a component or an FMU's path"
    parser.add_argument("name", nargs="?", metavar="NAME", help=text)
    parser.option("--building", "FILE", "with ports Structure: a building's data file", type=Path)
    text = "with effects, laws: a study whose own count too"
    parser.option("--study", "FOLDER", text, type=Path)
    parser.add_trust()
    parser.add_json("print as JSON")


def main(arguments: argparse.Namespace) -> int:
    """Print the lists that were asked for, or everything about one effect or law."""
    from ..errors import ScenarioError

    kind, name = arguments.kind, arguments.name
    if kind == "ports" and not name:
        raise ScenarioError("list ports: expected a name, e.g. bristle list ports LuGreDamper.")
    if name and kind not in ("ports", "effects", "laws"):
        raise ScenarioError(f'list {kind}: only ports, effects and laws take a name, not "{name}".')
    if arguments.building and kind != "ports":
        raise ScenarioError("list: --building goes with ports alone.")
    if arguments.study and kind not in ("effects", "laws"):
        raise ScenarioError("list: --study goes with effects and laws alone.")
    if kind in ("effects", "laws"):
        return _physics(kind.removesuffix("s"), arguments)
    tables: dict[str, Rows] = {}
    if kind in (None, "components"):
        tables["components"] = _components()
    if kind == "ports":
        tables["ports"] = _ports(name, arguments.building)
    if kind in (None, "records"):
        tables["records"] = _records()
    if kind in (None, "scenarios"):
        tables["scenarios"] = _scenarios()
    if kind is None:
        tables |= {f"{word}s": _all_of(word) for word in ("effect", "law")}
    if arguments.json:
        print_json(tables[kind] if kind else tables)
        return 0
    switches: list[str] = []
    if kind == "ports":
        ports = tables[kind]
        if not name.lower().endswith(".fmu"):  # one of the library's, which may have any effect
            switches = [port["name"] for port in ports if port["name"].endswith(".on")]
        hidden = tuple(switch.removesuffix("on") for switch in switches)
        tables = _by_causality([port for port in ports if not port["name"].startswith(hidden)])
    for title, rows in tables.items():
        _print(title, rows)
    if switches:
        effects = ", ".join(switch.removesuffix(".on") for switch in switches)
        _say(
            "Effects, each with a switch EFFECT.on and parameters of its own, in an FMU those of "
            f"build --effects: {effects}."
        )
        print("All of one:  bristle list effects NAME")
    return 0


def _by_causality(ports: Rows) -> dict[str, Rows]:
    """Return the tables of inputs, outputs and parameters, in short columns."""
    tables: dict[str, Rows] = {}
    for port in ports:
        causality, _, optional = port["causality"].partition(" ")
        row = {
            "name": port["name"],
            "unit": port["unit"] if port["type"] == "Real" else port["type"],
            "start": port["start"], "from": port["minimum"], "to": port["maximum"],
            "meaning": " ".join(filter(None, (optional, port["description"]))),
        }  # fmt: skip
        tables.setdefault(f"{causality}s", []).append(row)
    return tables


def _physics(word: str, arguments: argparse.Namespace) -> int:
    """Print a table of effects or laws, or everything about one."""
    from ..core.text import unknown
    from ..errors import PhysicsError
    from ..user_code.load import waiting

    study, name = arguments.study, arguments.name
    left_out = _read_own(study, word)
    known = _registered(word)
    if name in left_out and (untrusted := waiting(study / f"{word}s" / f"{name}.py")):
        raise untrusted
    if name is not None and name not in known:
        raise PhysicsError(left_out.get(name) or unknown(word, name, sorted(known)))
    as_dict, show = _TOLD[word]
    if arguments.json:
        print_json(as_dict(known[name]) if name else [as_dict(known[one]) for one in sorted(known)])
    elif name:
        show(as_dict(known[name]))
    else:
        _print(f"{word}s", _all_of(word))
        print(f"All of one:  bristle list {word}s NAME")
    for text in left_out.values():
        print(f"left out: {text}", file=sys.stderr)
    return 0


def _all_of(word: str) -> Rows:
    """Return the rows of effects or laws in the table of all."""
    known = _registered(word)
    return [_in_brief(_TOLD[word][0](known[name])) for name in sorted(known)]


def _registered(word: str) -> Mapping[str, Any]:
    """Return the effects or laws that are known, by name."""
    from ..physics import effects as _registered  # noqa: F401  (importing registers them)
    from ..physics.effect import EFFECTS
    from ..physics.laws import laws_of

    return EFFECTS if word == "effect" else {law.name: law for law in laws_of("damper")}


def _in_brief(row: dict[str, Any]) -> dict[str, Any]:
    """Return the row of an effect or a law in the table of all."""
    about = row["about"].removesuffix(".")
    if "sites" not in row:
        return {"name": row["name"], "description": about}
    site, said = ", ".join(row["sites"]), about.partition(": ")[2]  # the name stands before it
    return {"name": row["name"], "site": site, "description": said}


def _components() -> Rows:
    from ..fmu import catalogue

    names = catalogue.component_names()
    return [{"name": name, "description": catalogue.describe(name).description} for name in names]


def _describe(name: str, building: Path | None) -> Description:
    """Return the description of a built-in component or of an FMU file."""
    from ..core.text import unknown
    from ..errors import ScenarioError
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
    from ..system.scenario import stock_scenarios

    rows = []
    for file in stock_scenarios():
        title = toml_content(file).get("title", file.stem)
        rows.append({"name": file.stem, "title": title, "file": str(file)})
    return rows


def _print(title: str, rows: Rows) -> None:
    """Print one table."""
    columns = [
        column
        for column in (rows[0] if rows else {})
        if column != "file" and any(row[column] not in (None, "") for row in rows)
    ]
    heads = [f"{column} [{_UNITS[column]}]" if column in _UNITS else column for column in columns]
    cells = [[_cell(row[column]) for column in columns] for row in rows]
    print("\n".join(lines(Table(heads, cells, title=title)) if rows else [f"{title}: none"]))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return typed(value) if isinstance(value, float) else str(value)


def _read_own(study: Path | None, word: str) -> dict[str, str]:
    """Register the files of a study; return those that are left out, and why."""
    if study is None:
        return {}
    from ..errors import PhysicsError
    from ..user_code.load import load

    if not study.is_dir():
        raise PhysicsError(f"--study {study}: there is no such folder.")
    load(study / "laws", "law")  # what an effect joins
    return {one.name: one.error for one in load(study / f"{word}s", word) if one.error}


def effect_as_dict(effect: Any) -> dict[str, Any]:
    """Return what users are told of an effect: class data, first line and formula of its text."""
    from ..physics.effect import laws_joined

    about, text = _text_of(effect)
    return {
        "name": effect.name,
        "site": effect.site,
        "sites": list(effect.sites),
        "laws": list(laws_joined(effect)),
        "about": about,
        "text": text,
        "expect": effect.expect,
        "source": effect.source,
        "passive": effect.passive,
        "zero_at_rest": effect.zero_at_rest,
        "excludes": list(effect.excludes),
        "states": dict(effect.states),
        "parameters": _parameters_of(effect),
    }


def _print_effect(found: dict[str, Any]) -> None:
    _say(f"{found['name']} ({', '.join(found['sites'])}): {found['about']}")
    print(f"\n{found['text']}\n")
    _say(f"When it is missing: {found['expect']}.")
    if found["laws"]:
        _say(f"Laws that it joins: {', '.join(found['laws'])}.")
    _say(f"Source: {found['source']}.")
    _print_parameters(found, f"{found['name']}.")
    if found["site"] == "sensor":
        print("\nUsed in a model that is compared with measurements; never inside a damper.")
    else:
        places = " or a ".join(found["sites"])
        print(f'\nIn a scenario, among the parameters of a {places}:  "{found["name"]}.on" = true')
    if len(found["sites"]) > 1:
        first, *others = found["sites"]
        named = " or ".join(f"{found['name']}@{site}" for site in others)
        print(f"In a building's model the name alone is that of the {first}; else {named}.")


def law_as_dict(law: Any) -> dict[str, Any]:
    """Return what users are told of a law: class data, first line and formula of its text."""
    from ..physics.effect import effects_of
    from ..physics.forms import FORMS, LINEAR_FORM, choosable

    about, text = _text_of(law)
    free = list(choosable(law))  # quantities that may have another form
    return {
        "name": law.name,
        "about": about,
        "text": text,
        "parts": list(law.parts),
        "contains": list(law.contains),
        "command": {
            quantity: [type(form).__name__.lower(), *form.names()]
            for quantity, form in law.command.items()
        },
        "forms": {form: free for form in FORMS if form != LINEAR_FORM and free},
        "source": law.source,
        "states": dict(law.states),
        "variants": [f"{law.name}_{suffix}" for suffix in law.variants],
        "inverse": law.affine() and law.exact() and not law.felt,
        "effects": [effect.name for effect in effects_of("damper", law.name)],
        "parameters": _parameters_of(law),
    }


def _print_law(found: dict[str, Any]) -> None:
    _say(found["about"])
    print(f"\n{found['text']}\n")
    print(f"Parts: {', '.join(found['parts'])}.")
    if found["contains"]:
        print(f"Contains: {', '.join(found['contains'])}; no effect of that kind is offered.")
    for quantity, (form, *names) in found["command"].items():
        _say(f"Over the voltage: {quantity} is {form}, by {', '.join(names)}.")
    if found["forms"]:
        forms = ", or ".join(f"--command {form}" for form in found["forms"])
        print(f"To be identified in another form too:  {forms}")
    print(f"Inverse for controllers: {'yes' if found['inverse'] else 'no'}.")
    _say(f"Effects that join it: {', '.join(found['effects'])}.")
    _say(f"Source: {found['source']}.")
    _print_parameters(found, "")
    print(f"\nIn a study:  bristle identify STUDY --law {found['name']}")


_TOLD = {"effect": (effect_as_dict, _print_effect), "law": (law_as_dict, _print_law)}
"""What is told of one, as JSON has it, and what prints that."""


def _say(text: str) -> None:
    print("\n".join(lines(Text(text))))


def _parameters_of(one: Any) -> dict[str, Any]:
    """Return what users are told of the parameters."""
    return {
        name: {
            "value": parameter.value,
            "unit": parameter.unit,
            "bounds": list(parameter.bounds),
            "text": parameter.text,
        }
        for name, parameter in one.parameters.items()
    }


def _text_of(one: Any) -> tuple[str, str]:
    """Return the first line of a docstring, and the rest of it."""
    import textwrap

    first, _, rest = (one.__doc__ or "").strip().partition("\n")
    return first.strip(), textwrap.dedent(rest).strip("\n")


def _print_parameters(found: dict[str, Any], begin: str) -> None:
    """Print a row per parameter: value, unit, bounds, meaning."""
    rows = [
        [f"{begin}{name}", typed(about["value"]), about["unit"], *map(tick, about["bounds"]),
         about["text"]]
        for name, about in found["parameters"].items()
    ]  # fmt: skip
    header = ("parameter", "value", "unit", "from", "to", "meaning")
    print("", *lines(Table(header, rows, (1, 3, 4))), sep="\n")
