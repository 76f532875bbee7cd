"""Values as the text of a Python file: a study's name may hold quotes and backslashes."""

from __future__ import annotations

import json
from collections.abc import Sequence


def literal(text: str) -> str:
    """Return a text as a Python literal in double quotes."""
    return json.dumps(text, ensure_ascii=False)  # Python has all of its escapes


def in_docstring(text: str) -> str:
    """Return a text as it stands between triple quotes, where Python reads that text."""
    return text.replace("\\", "\\\\").replace('"""', r"\"\"\"")


def class_data(value: object) -> str:
    """Return a dictionary of texts, a tuple of names or a bool as source, in double quotes."""
    if isinstance(value, dict):
        return json.dumps(value, ensure_ascii=False)
    return f"{value!r}".replace("'", '"')


def row(begin: str, values: Sequence[float], end: str = "") -> list[str]:
    """Return the lines of a tuple of numbers, some to a line."""
    texts = [f"{float(f'{value:.6g}')!r}," for value in values]  # 0.0, for numba wants one type
    rows = [" ".join(texts[k : k + 6]) for k in range(0, len(texts), 6)]
    return [f"{begin}(", *(f"    {one}" for one in rows), f"){end}"]
