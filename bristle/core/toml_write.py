"""Keys and values as TOML writes them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_key(name: str) -> str:
    """Return a name as a key of TOML, with quotes where it needs them."""
    return name if _BARE.fullmatch(name) else toml_value(name)


def toml_value(value: object) -> str:
    """Return a value as TOML writes it: a number, a text, true or false, a list or a table."""
    if isinstance(value, Mapping):
        pairs = (f"{toml_key(key)} = {toml_value(item)}" for key, item in value.items())
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # "inf", "-inf", "nan", as TOML spells them
    if isinstance(value, str):  # JSON's escapes are TOML's; only DEL is missing
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def toml_text(content: Mapping[str, object]) -> str:
    """Return a document: its plain keys, and behind them a table for each mapping."""
    tables = {name: one for name, one in content.items() if isinstance(one, Mapping)}
    lines = toml_table({key: one for key, one in content.items() if key not in tables})
    for name, table in tables.items():
        lines += ["", f"[{toml_key(name)}]", *toml_table(table)]
    return "\n".join(lines) + "\n"


def toml_table(table: Mapping[str, object]) -> list[str]:
    """Return the lines of a table, one for each of its keys."""
    return [f"{toml_key(key)} = {toml_value(value)}" for key, value in table.items()]
