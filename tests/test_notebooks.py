"""The tutorial notebooks: whole, without outputs, and their cells run one after the other."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
LAST = (
    "\nimport os, sys\nfor one in SHOWN:\n"
    "    html = getattr(one, '_repr_html_', None)\n"
    "    assert '<' in (html and html() or '<')\n"
    "    png = getattr(one, '_repr_png_', None)\n"
    "    assert png is None or png().startswith(b'\\x89PNG')\n"
    "print('pictures and tables:', len(SHOWN))\nsys.stdout.flush()\nos._exit(0)\n"
)
"""Draws what a notebook would show of the last line of each cell; on the exit see docs/snippets."""


def cells(path: Path) -> list[dict[str, Any]]:
    content = json.loads(path.read_text(encoding="utf-8"))
    assert (content["nbformat"], content["nbformat_minor"]) == (4, 5)
    found: list[dict[str, Any]] = content["cells"]
    return found


def as_script(path: Path) -> str:
    """Return the code of a notebook; what the last line of a cell gives is kept in SHOWN."""
    import ast

    lines = ["SHOWN = []"]
    for cell in cells(path):
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        last = tree.body[-1]
        if isinstance(last, ast.Expr):
            tree.body[-1] = ast.parse(f"SHOWN.append({ast.unparse(last.value)})").body[0]
        lines.append(ast.unparse(tree))
    return "\n".join(lines) + LAST


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_whole_and_holds_no_output(path: Path) -> None:
    found = cells(path)
    assert found[0]["cell_type"] == "markdown"
    assert found[0]["source"][0].startswith("# ")
    assert len({cell["id"] for cell in found}) == len(found)
    for cell in found:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None


@pytest.mark.slow  # a notebook's cells, with runs and fits
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_cells_of_a_notebook_run_and_what_they_show_is_drawn(
    path: Path, tmp_path: Path
) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "BRISTLE_STATE": str(tmp_path / "state")}
    done = subprocess.run(
        [sys.executable, "-c", as_script(path)], cwd=tmp_path, env=environment, check=False,
        capture_output=True, text=True, timeout=900,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    assert "pictures and tables: " in done.stdout


def test_there_is_one_for_a_bench_and_one_for_scenarios() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["bench", "scenarios"]
