"""The figure of the laws after identification: its numbers, and what the paper's text says."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from benchmarks.paper.figures import make


@pytest.mark.slow  # every law is fitted: the order of the paper's text
def test_laws_are_in_the_order_that_the_text_gives(tmp_path: Path) -> None:
    image, table, loops = make("identification", tmp_path)
    assert image.stat().st_size > 50_000
    error = pd.read_csv(table, comment="#").set_index(["bristle", "law"])["error RMS [N]"]
    for bristle in ("a_0 = 500 1/m", "a_0 = 2000 1/m"):
        assert error[bristle, "lugre"] < error[bristle, "bingham"]
        for law in ("bingham", "lugre"):
            assert error[bristle, law] < error[bristle, f"{law}_standard"]
    # A stiffer bristle is nearer to the Bingham law: LuGre without its exponential errs less.
    assert error["a_0 = 2000 1/m", "lugre_standard"] < error["a_0 = 500 1/m", "lugre_standard"]
    own = pd.read_csv(loops, comment="#")
    damper = own[(own.law == "damper") & (own.bristle == "a_0 = 500 1/m")]
    # Physics, section 3.4: the largest force of this loop at 4 V, fifth cycle.
    assert damper["force [N]"].max() == pytest.approx(5.940939, rel=1e-3)
