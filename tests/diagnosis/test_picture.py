"""The picture of a verdict: whose z the dashed line is, and a bar for the effects that it names."""

from __future__ import annotations

from typing import Any

import pytest

from bristle.diagnosis.view import draw_verdict

LAWS = {"law": "dahl", "command": "quadratic", "laws": [{"law": "dahl", "command": "quadratic"}]}
PAIR: dict[str, Any] = {
    "kind": "effect", "effects": ["delay", "gas_spring"],
    "findings": [{
        "site": "damper", "kind": "effect", "effects": ["delay", "gas_spring"],
        "z_holdout_before": 4.1, "z_holdout_after": 1.02,
    }],
    "ranking": [
        {"effect": "delay", "site": "damper", "z_holdout": 1.8},
        {"effect": "gas_spring", "site": "damper", "z_holdout": 3.1},
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("laws", "words"),
    [
        (LAWS, "dahl with a quadratic command, the law of this verdict, alone"),
        ({}, "the present model"),
    ],
)
def test_the_dashed_line_names_its_model(laws: dict[str, Any], words: str) -> None:
    page = draw_verdict(PAIR | laws)
    assert page.figure.axes[0].get_title(loc="right") == f"dashed: {words}, z = 4.10"


def test_the_pair_of_effects_that_a_verdict_names_has_a_bar() -> None:
    page = draw_verdict(PAIR)
    names = [label.get_text() for label in page.figure.axes[0].get_yticklabels()]
    assert names == ["with delay\nand gas spring", "with delay", "with gas spring"]
