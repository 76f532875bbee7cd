"""The generator of hidden effects stands alone, and gives what it was asked for."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from .generate import make_case

HERE = Path(__file__).parent


@pytest.mark.parametrize("path", sorted(HERE.glob("*.py")), ids=lambda path: path.name)
def test_shares_no_code_with_the_package(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not any(name.split(".")[0] == "bristle" for name in names)


def test_reaches_the_share_that_was_asked_for():
    case = make_case(1, "gas_spring", None, 0.15, 0.01, "bench_10N", "lugre")
    assert case.truth["share"] == pytest.approx(0.15, abs=0.005)
    assert len(case.runs) == 7


def test_a_seed_gives_the_same_case_again():
    first, second = (make_case(3, "none", None, 0.15, 0.01, "bench_10N", "lugre") for _ in "ab")
    for one, other in zip(first.runs, second.runs, strict=True):
        assert np.array_equal(one["force"], other["force"])
