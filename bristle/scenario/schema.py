"""The JSON schema of scenario files, made from the components that there are, for editors.

It covers what a schema can say: keys, types, names and bounds of parameters. Units, connections
and physics are for `bristle check`.
"""

from __future__ import annotations

import json
from typing import Any

from ..component import OVER_STEP
from ..fmu.description import Description, Variable
from ..physics.forms import FORMS
from .checks import SCHEMA
from .connections import FACTOR, FROM, OFFSET
from .library import Library, installed
from .parameters import choices
from .parts import ALGORITHMS

_TYPES = {"Real": "number", "Boolean": "boolean", "String": "string"}
_TIME = {"type": "number", "exclusiveMinimum": 0}
_PORT = r"^[^.]+\.."


def schema_text() -> str:
    """Return the schema as the text of scenarios/scenario.schema.json."""
    return json.dumps(build_schema(), indent=2, ensure_ascii=False) + "\n"


def build_schema(library: Library | None = None) -> dict[str, Any]:
    """Return the JSON schema (draft 7) of a scenario file."""
    library = library or installed()
    names = list(library.names())
    definitions = {name: _parameters(library.describe(name, None, None)) for name in names}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "bristle scenario",
        "type": "object",
        "required": ["schema", "run", "components"],
        "additionalProperties": False,
        "properties": {
            "schema": {"const": SCHEMA, "description": "version of this format"},
            "title": {"type": "string", "description": "title of figures and tables"},
            "run": _run(),
            "components": {
                "type": "object",
                "description": "they step in this order, but for jacobi",
                "minProperties": 1,
                "additionalProperties": _component(names),
            },
            "connections": {
                "type": "object",
                "description": '"component.input" = "component.output"',
                "additionalProperties": {
                    "anyOf": [
                        {"type": "string", "pattern": _PORT},
                        _transformed(),
                        {"type": "object", "additionalProperties": {"type": ["string", "object"]}},
                    ]
                },
            },
        },
        "definitions": definitions,
    }


def _transformed() -> dict[str, Any]:
    """Return the schema of a connection that gives factor x output + offset."""
    numbers = {name: {"type": "number"} for name in (FACTOR, OFFSET)}
    return {
        "type": "object",
        "description": "input = factor x output + offset",
        "required": [FROM],
        "additionalProperties": False,
        "properties": {FROM: {"type": "string", "pattern": _PORT}, **numbers},
    }


def _run() -> dict[str, Any]:
    return {
        "type": "object",
        "required": ["stop", "step"],
        "additionalProperties": False,
        "properties": {
            "stop": {**_TIME, "description": "end of the run, a whole number of steps [s]"},
            "step": {**_TIME, "description": "communication step [s]"},
            "algorithm": {"enum": list(ALGORITHMS), "default": ALGORITHMS[0]},
        },
    }


def _component(names: list[str]) -> dict[str, Any]:
    """Return the schema of one component; its parameters depend on its FMU."""
    each: list[dict[str, Any]] = [
        {
            "if": {
                "required": ["fmu"],
                "not": {"required": ["command"]},
                "properties": {"fmu": {"const": name}},
            },
            "then": {"properties": {"parameters": {"$ref": f"#/definitions/{name}"}}},
        }
        for name in names
    ]
    only = {
        "if": {"required": ["building"]},
        "then": {"properties": {"fmu": {"const": "Structure"}}},
    }
    return {
        "type": "object",
        "oneOf": [{"required": ["fmu"]}, {"required": ["law"]}],
        "additionalProperties": False,
        "properties": {
            "fmu": {
                "description": "a built-in name, or a path relative to this file",
                "anyOf": [{"enum": names}, {"type": "string", "pattern": r"(\.[fF][mM][uU]|/|\\)"}],
            },
            "law": {
                "type": "string",
                "description": "a damper's law in place of fmu: its name, or a file of your own",
            },
            "command": {"enum": list(FORMS), "description": "how the command enters the law"},
            "command_knots": {
                "type": "array",
                "items": {"type": "number"},
                "description": "knots of a table over the command [V]",
            },
            "building": {"type": "string", "description": "data file of another building"},
            "effects": {
                "description": "files with effects of your own, for a built-in damper or Structure",
                "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
            },
            "controller": {
                "type": "string",
                "description": "controller file of bristle design, for a designed controller",
            },
            "step": {**_TIME, "description": "the run's step divided by a whole number [s]"},
            "over_step": {
                "type": "object",
                "description": "how a foreign FMU takes its inputs over a step; an output that "
                "stands between instants is sampled",
                "additionalProperties": {"enum": list(OVER_STEP)},
            },
            "parameters": {"type": "object"},
        },
        "allOf": [*each, only],
    }


def _parameters(description: Description) -> dict[str, Any]:
    """Return the schema of an FMU's parameters and inputs.

    `"gas_spring.on" = true` and `gas_spring.on = true` are the same to bristle, and two things
    to a schema: dotted names stand in it both ways.
    """
    properties: dict[str, Any] = {}
    for variable in [*description.of("parameter"), *description.of("input")]:
        entry = _value(variable)
        properties[variable.name] = entry
        group, dot, inner = variable.name.partition(".")
        if dot:
            table = properties.setdefault(
                group, {"type": "object", "additionalProperties": False, "properties": {}}
            )
            table["properties"][inner] = entry
    return {
        "type": "object",
        "description": description.description,
        "additionalProperties": False,
        "properties": properties,
    }


def _value(variable: Variable) -> dict[str, Any]:
    unit = f" [{variable.unit}]" if variable.unit else ""
    entry: dict[str, Any] = {
        "type": _TYPES.get(variable.kind, "integer"),
        "description": f"{variable.description}{unit}".strip(),
    }
    if variable.causality == "input":
        entry["description"] = f"held constant, instead of a connection: {entry['description']}"
    elif variable.start is not None:
        entry["default"] = variable.start
    allowed = choices(variable) if variable.kind == "String" else ()
    if allowed:
        entry["enum"] = list(allowed)
    if variable.minimum is not None:
        entry["minimum"] = variable.minimum
    if variable.maximum is not None:
        entry["maximum"] = variable.maximum
    return entry
