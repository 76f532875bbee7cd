"""Published and derived numbers as nested tables; the file says what each is worth."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

_FILE = Path(__file__).parents[1] / "reference" / "model.toml"
MODEL: dict[str, Any] = tomllib.loads(_FILE.read_text(encoding="utf-8"))
