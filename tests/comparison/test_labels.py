"""How a sentence names the runs in which a model errs: their values in order, and as ranges."""

from __future__ import annotations

from collections.abc import Mapping

from bristle.comparison.conditions import LabelError, label_sentence


def told(z: Mapping[float, float], runs: int = 1) -> str:
    return label_sentence([LabelError("temperature", at, one, runs) for at, one in z.items()])


def test_levels_of_several_runs_are_named_each_in_order() -> None:
    assert told({10.0: 1.0, 20.0: 4.0, 30.0: 4.1, 40.0: 1.1, 50.0: 4.2}, runs=3) == (
        "Only the runs at temperature 20 °C, 30 °C and 50 °C are wrong: z = 4.20, and z = 1.10 at "
        "most at 10 °C and 40 °C."
    )


def test_values_that_each_run_has_of_its_own_are_ranges() -> None:
    warm = {29.4: 4.0, 28.2: 5.0, 29.0: 4.5, 30.1: 4.2}
    cold = {20.3: 1.0, 21.0: 0.9, 22.5: 1.1, 20.9: 1.0}
    assert told(warm | cold) == (
        "Only the runs at temperature 28.2 °C to 30.1 °C are wrong: z = 5.00, and z = 1.10 at most "
        "at 20.3 °C to 22.5 °C."
    )
    assert "at 20.3 °C to 22.5 °C and 33 °C." in told(warm | cold | {33.0: 1.0})


def test_values_that_lie_among_others_are_listed() -> None:
    mixed = {20.0 + k: (5.0 if k % 2 else 1.0) for k in range(9)}
    assert told(mixed) == (
        "Only the runs at temperature 21 °C, 23 °C, 25 °C and 27 °C are wrong: z = 5.00, and "
        "z = 1.00 at most at 20 °C, 22 °C, 24 °C, 26 °C and 28 °C."
    )
    many = {20.0 + k: (5.0 if k % 2 else 1.0) for k in range(20)}
    assert "at temperature 10 of 20 values, among them 21 °C, 23 °C" in told(many)


def test_one_run_that_has_a_value_of_its_own_is_named() -> None:
    def errors(other: float) -> list[LabelError]:
        z = {"a": 1.0, "late": 4.4, "b": other}
        return [
            LabelError("temperature", 20.0 + k, one, 1, run=run)
            for k, (run, one) in enumerate(z.items())
        ]

    assert label_sentence(errors(1.1)) == (
        "Only late is wrong: z = 4.40, and z = 1.10 at most in the other runs. It is the only run "
        "at temperature 21 °C, which need not be the cause."
    )
    assert label_sentence(errors(1.9)).startswith(
        "The error is largest in late: z = 4.40, and z = 1.90 at"
    )


def test_words_are_named_each() -> None:
    errors = [LabelError("oil", f"batch {k}", 5.0 if k > 1 else 1.0, 1) for k in range(5)]
    assert "at oil batch 2, batch 3 and batch 4 are wrong" in label_sentence(errors)
