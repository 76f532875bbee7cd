"""Checks a file with a user's effect or law: `python -m bristle.user_code.own effect FILE`, as
JSON.

`bristle check` runs it in a process of its own, under a limit.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path

from ..trust import load_file
from .conformance import examine, examine_law


def main() -> int:
    """Print what is asked of the file's effect or law, and whether it holds."""
    word, file = sys.argv[1:3]
    made = load_file(Path(file), word)
    checks = examine(made) if word == "effect" else examine_law(made)
    print(json.dumps([asdict(check) for check in checks]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
