"""The pictures of the pages: which command makes which, and how they are made anew.

python docs/gallery.py   runs the commands in a folder of their own; takes some minutes
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
FIGURES = ROOT / "docs" / "figures"
WIDTH = 1200
"""Of a picture [px]."""


class Shown(NamedTuple):
    """A picture: what is run, which file it leaves, and its name in docs/figures."""

    command: str
    picture: str
    name: str


BENCH = (
    Shown("example bench my_rig", "", ""),
    Shown("study check my_rig", "my_rig/reports/data_check.png", "gallery-data-check"),
    Shown("identify my_rig", "my_rig/reports/identify.png", "gallery-identify"),
    Shown("compare my_rig", "my_rig/reports/compare.png", "gallery-compare"),
    Shown("diagnose my_rig", "my_rig/reports/diagnose.png", "gallery-diagnose"),
)
BUILDING = (
    Shown("example building house", "", ""),
    Shown("identify house", "", ""),
    Shown("compare house", "house/reports/compare.png", "gallery-building"),
)


def make() -> list[Path]:
    """Run the commands and write the pictures into docs/figures; return the files."""
    from refresh import shrunk

    made = []
    with tempfile.TemporaryDirectory() as name:
        for one in (*BENCH, *BUILDING):
            subprocess.run(
                [sys.executable, "-m", "bristle.cli", *one.command.split()], cwd=name, check=True,
                stdout=subprocess.DEVNULL,
            )  # fmt: skip
            if one.picture:
                target = FIGURES / f"{one.name}.png"
                made.append(shrunk(Path(name, one.picture), target, WIDTH))
                print(target)
    return made


if __name__ == "__main__":
    make()
