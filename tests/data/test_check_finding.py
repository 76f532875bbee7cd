"""What several runs share is told once, by the worst of them."""

from __future__ import annotations

import pytest

from bristle.core.finding import Finding, grouped, sentence


def test_a_warning_in_one_run_and_notes_in_others_are_told_once():
    rows = [
        Finding("offset", "note", "a mean of 3 N.", run="first", channel="force", value=0.9),
        Finding("offset", "warning", "a mean of 9 N.", run="second", channel="force", value=0.3),
        Finding("offset", "note", "a mean of 4 N.", run="third", channel="force", value=0.2),
        Finding("drift", "note", "the force drifts.", run="first", channel="force"),
    ]
    (worst, group), (other, _) = grouped(rows)
    assert (worst.run, worst.level, other.kind) == ("second", "warning", "drift")
    assert sentence(worst, group) == "second: a mean of 9 N. (3 to 9 N in 3 runs)"


def test_the_same_is_said_of_equal_sentences_alone():
    def told(*texts: str) -> list[str]:
        rows = [Finding("reading", "note", text, run=f"r{k}") for k, text in enumerate(texts)]
        return [sentence(worst, group) for worst, group in grouped(rows)]

    warm = [f"temperature: {mean} °C, the mean of the run" for mean in ("24.8", "33.7", "30.1")]
    assert told(*warm) == [f"r0: {warm[0]} (24.8 to 33.7 °C in 3 runs)"]
    assert told("not UTF-8", "no velocity", "not UTF-8") == [
        "r0: not UTF-8 (the same in 1 other run)", "r1: no velocity",
    ]  # fmt: skip
    noise = [
        Finding("noise", "warning", text, run=f"r{k}", channel="force", value=value)
        for k, (text, value) in enumerate([
            ("noise of force: 2 N; a lower limit.", 0.01), ("noise of force: 3 N; slow.", 0.02),
            ("noise of force: 900 N; slow.", 3.0),
        ])
    ]  # fmt: skip
    assert [sentence(*one) for one in grouped(noise)] == [
        "r0: noise of force: 2 N; a lower limit.",
        "r2: noise of force: 900 N; slow. (3 to 900 N in 2 runs)",
    ]
    units = [Finding("size", "warning", text, run=text) for text in ("900 N", "1.1 kN")]
    assert sentence(*grouped(units)[0]) == "900 N: 900 N (similar in 1 other run)"


def test_runs_that_each_differ_in_their_own_way_are_told_one_by_one():
    rows = [Finding("run gain", "error", "1.4 times", run=run, channel="force") for run in "ab"]
    assert [one.run for one, _ in grouped(rows)] == ["a", "b"]


@pytest.mark.parametrize(
    ("texts", "also"),
    [
        (("from 12.68 to 12.9 mm it", "from 12.71 to 12.9 mm it"), "12.68 to 12.71 mm in 2 runs"),
        (("is 1.18 x the others", "is 1.23 x the others"), "1.18 to 1.23 in 2 runs"),
        (("3 in it", "4 in it"), "3 to 4 in 2 runs"),
        (("1 (± 0.2) by 7 %", "1 (± 0.3) by 8 %"), "7 to 8 % in 2 runs"),
        (("off by 3 %, late", "off by 4 %, late"), "3 to 4 % in 2 runs"),
        (
            ("1.2 \u00d7 10⁻¹⁰ m, low", "1.3 \u00d7 10⁻¹⁰ m, low"),
            "1.2 to 1.3 \u00d7 10⁻¹⁰ m in 2 runs",
        ),
        (("1.18 times as much", "1.2 times as much"), "1.18 to 1.2 times in 2 runs"),
    ],
)
def test_a_range_over_runs_has_its_unit_alone(texts: tuple[str, str], also: str) -> None:
    both = [Finding("off", "warning", text, run=f"r{k}") for k, text in enumerate(texts)]
    assert sentence(*grouped(both)[0]).endswith(f" ({also})")
