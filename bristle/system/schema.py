"""The JSON schema of scenario files, made from the components that there are, for editors.

It covers what a schema can say: keys, types, names and bounds of parameters. Units, connections
and physics are for `bristle check`.
"""

from __future__ import annotations

import json
from typing import Any

from ..core.config import SCHEMA, json_schema
from ..fmu.catalogue import component_names, describe
from ..fmu.description import Description, Variable
from .connections import FACTOR, FROM, OFFSET
from .model import choices
from .overrides import COMPONENT, SCENARIO

_TYPES = {"Real": "number", "Boolean": "boolean", "String": "string"}
_PORT = r"^[^.]+\.."


def schema_text() -> str:
    """Return the schema as the text of scenarios/scenario.schema.json."""
    return json.dumps(build_schema(), indent=2, ensure_ascii=False) + "\n"


def build_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 7) of a scenario file."""
    names = component_names()
    whole = json_schema(SCENARIO)
    whole["required"] = ["schema", "run", "components"]
    tables = whole["properties"]
    tables["components"] |= {"minProperties": 1, "additionalProperties": _component(names)}
    tables["connections"]["additionalProperties"] = {
        "anyOf": [
            {"type": "string", "pattern": _PORT},
            _transformed(),
            {"type": "object", "additionalProperties": {"type": ["string", "object"]}},
        ]
    }
    whole["properties"] = {
        "schema": {"const": SCHEMA, "description": "version of this format"}, **tables
    }  # fmt: skip
    return {
        "$schema": "http://json-schema.org/draft-07/schema#", "title": "bristle scenario", **whole,
        "definitions": {
            name: _parameters(describe(name, ranged=True)) for name in names
        },
    }  # fmt: skip


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
    whole = json_schema(COMPONENT)
    whole["oneOf"] = [{"required": ["fmu"]}, {"required": ["law"]}]
    own = {"type": "string", "pattern": r"(\.[fF][mM][uU]|/|\\)"}
    for key, either in (
        ("fmu", [{"enum": names}, own]),
        ("effects", [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]),
    ):
        about = whole["properties"][key]["description"]
        whole["properties"][key] = {"description": about, "anyOf": either}
    whole["properties"]["parameters"] = {"type": "object"}
    return {**whole, "allOf": [*each, only]}


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
