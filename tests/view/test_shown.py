"""A shell shows what a result says, not its arrays."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest

import bristle
from bristle.core.text import shown
from bristle.model.model import Fact, Model

RESULTS = (
    "Comparison", "DesignResult", "Diagnosis", "Ensemble", "Identified", "Measurement", "Plan",
    "Study",
)  # fmt: skip
OTHERS = (
    ("controller_comparison.result", "ControllerComparison"), ("optimal_control.limit", "Limit"),
    ("learning.result", "LearnedEffect"), ("study.data_check", "DataCheck"),
    ("model.model", "Model"),
)  # fmt: skip


@pytest.mark.parametrize("name", RESULTS)
def test_public_results_have_words_of_their_own(name):
    written = getattr(bristle, name).__repr__
    assert not hasattr(written, "__wrapped__")  # that of a dataclass
    assert written is not object.__repr__


@pytest.mark.parametrize(("module", "name"), OTHERS)
def test_so_have_results_that_are_not_imported_by_name(module, name):
    written = getattr(import_module(f"bristle.{module}"), name).__repr__
    assert not hasattr(written, "__wrapped__")


def test_a_model_is_shown_with_its_parameters_and_units():
    facts = {"f_c": Fact(1.25, "N", 0.0, 9.0), "gas_spring.k": Fact(2.5, "N/m", 0.0, 9.0)}
    model = Model("bingham", ("gas_spring",)).with_facts(facts)
    assert repr(model) == (
        "<Model: bingham + gas_spring>\n  f_c = 1.25 N\n  gas_spring.k = 2.5 N/m"
    )


def test_lines_stand_below_the_class():
    assert shown(np.float64(1.0), "", ["one"]) == "<float64>\n  one"
