"""What a search tells on its way: how much of the cost each effect leaves, and z of the refined."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from bristle.core.progress import telling
from bristle.diagnosis import trials

COSTS = {"gas_spring": 0.5, "stribeck": 1.9}


@dataclass
class Model:
    effects: tuple[str, ...] = ()
    values: dict[str, float] = field(default_factory=dict)


def test_what_each_effect_leaves_of_the_cost_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(name: str, *_: object) -> Any:
        return SimpleNamespace(model=Model((name,)), cost=COSTS[name])

    def judged(model: Model, *_: object) -> Any:
        return SimpleNamespace(model=model, z=1.25)

    context = SimpleNamespace(
        cost=2.0, expected=None, screening=lambda _: SimpleNamespace(cost=2.0)
    )
    for name, made in {
        "SearchContext": lambda *_: context, "joinable": lambda *_: list(COSTS),
        "guesses_of": lambda names, _: {own: [SimpleNamespace(cost=1.0)] for own in names},
        "short_search": searched, "judge": judged, "refine": lambda model, *_: model,
    }.items():  # fmt: skip
        monkeypatch.setattr(trials, name, made)
    said: list[str] = []
    held_out: Any = SimpleNamespace(expectation=lambda _: None)
    base: Any = Model()
    with telling(said.append):
        trials.try_all(base, held_out, held_out)
    text = "\n".join(said)
    assert re.search(r"effect \d of 2, gas_spring; 25 % of the cost remains; best so far", text)
    assert re.search(r"effect \d of 2, stribeck; 95 % of the cost remains", text)
    assert re.search(r"refining effect 1 of \d, gas_spring; z 1.25 on held-out runs", text)
