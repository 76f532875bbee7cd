"""What several runs share is told once, by the worst of them."""

from __future__ import annotations

from bristle.data.checks.finding import Finding, grouped, sentence


def test_a_warning_in_one_run_and_notes_in_others_are_told_once():
    rows = [
        Finding("offset", "note", "a mean of 3 N.", run="first", channel="force", value=0.9),
        Finding("offset", "warning", "a mean of 9 N.", run="second", channel="force", value=0.3),
        Finding("offset", "note", "a mean of 4 N.", run="third", channel="force", value=0.2),
        Finding("drift", "note", "the force drifts.", run="first", channel="force"),
    ]
    (worst, runs), (other, _) = grouped(rows)
    assert (worst.run, worst.level, other.kind) == ("second", "warning", "drift")
    assert sentence(worst, runs) == "second: a mean of 9 N. (the same in 2 other runs)"


def test_runs_that_each_differ_in_their_own_way_are_told_one_by_one():
    rows = [Finding("run gain", "error", "1.4 times", run=run, channel="force") for run in "ab"]
    assert [one.run for one, _ in grouped(rows)] == ["a", "b"]
