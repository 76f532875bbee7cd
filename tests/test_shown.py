"""A shell shows what a result says, not its arrays."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest

import bristle
from bristle.core.text import shown
from bristle.model.model import StudyModel, Value

RESULTS = (
    "Comparison", "DesignResult", "Diagnosis", "Ensemble", "Identified", "Measurement", "Plan",
    "Study",
)  # fmt: skip
OTHERS = (
    ("controller_comparison.result", "ControllerComparison"), ("optimal_control.limit", "Limit"),
    ("learning.result", "LearnedEffect"), ("study.data_check", "DataCheck"),
    ("model.model", "StudyModel"),
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
    value = Value(value=1.25, unit="N", low=0.0, high=9.0, free=True, std=None, origin="assumed")
    model = StudyModel("bingham", {"f_c": value}, {"gas_spring": {"k": value}})
    assert repr(model) == (
        "<StudyModel: bingham + gas_spring>\n  f_c = 1.25 N\n  gas_spring.k = 1.25 N"
    )


def test_lines_stand_below_the_class():
    assert shown(np.float64(1.0), "", ["one"]) == "<float64>\n  one"
