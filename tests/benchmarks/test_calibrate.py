"""The calibration of the decision rule: its seeds, its store, its counts, its page."""

from __future__ import annotations

import ast
import inspect
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import blind, calibrate
from benchmarks._blind import plan
from benchmarks._blind.plan import Task
from benchmarks._calibrate import page, trials, varied
from benchmarks._calibrate.trials import NotStoredError, Stored
from benchmarks._rows import write_between
from bristle.diagnosis import decision, inconsistent_runs
from bristle.diagnosis import site as damper
from bristle.diagnosis.decision import decide
from bristle.diagnosis.rule import (
    BENCH,
    DRIVE,
    INSIDE,
    LIMITED,
    RECONSTRUCTED,
    SENSOR,
    SITE,
    DecisionRule,
)
from bristle.diagnosis.trials import Trial
from bristle.model.model import Model

N = 5000
NOISE = np.random.default_rng(5).standard_normal(N) ** 2


def trial(z: float, *effects: str) -> Trial:
    losses = NOISE / NOISE.mean() * z**2 * 0.5
    return Trial(Model("bingham", effects), z, z, z, losses, np.sqrt(2.0 * losses))


def task(kind: str, effect: str) -> Task:
    return Task(kind, effect, "", 0.15, 0.01, "bench_10N", "bingham", plan.RESERVED + 1)


def case(kind: str, effect: str, before: float, *found: Trial, site: str = "") -> Stored:
    return Stored(task(kind, effect), site, "code", before=trial(before), single=list(found))


def test_every_field_says_what_it_decides_trades_and_how_it_was_found() -> None:
    said = varied.told()
    assert list(said) == varied.names()
    assert not [n for n, one in said.items() if not (one.decides and one.trades and one.found)]


def test_the_instances_differ_where_the_docs_say_so() -> None:
    assert varied.instances() == {
        "BENCH": BENCH, "INSIDE": INSIDE, "SITE": SITE, "SENSOR": SENSOR, "DRIVE": DRIVE,
        "LIMITED": LIMITED, "RECONSTRUCTED": RECONSTRUCTED,
    }  # fmt: skip
    assert (
        varied.values_of("gain")
        == "0.02, RECONSTRUCTED 0.05, SITE 0.03, SENSOR 0.03, DRIVE 0.03, LIMITED 0.03"
    )
    assert varied.values_of("noise_overestimated") == "0.9"


@pytest.mark.parametrize("base", [BENCH, SITE])
def test_todays_value_is_among_those_looked_at(base: DecisionRule) -> None:
    values = varied.SITE_VALUES if base == SITE else varied.BENCH_VALUES
    for name, looked in values.items():
        assert getattr(base, name) in looked
        assert list(looked) == sorted(set(looked))
    assert sum(rule == base for _, _, rule in varied.variants(base)) == len(values)


def fields_read(*functions: object) -> set[str]:
    """Return the fields of a rule that the source of modules or functions reads."""
    return {
        node.attr
        for one in functions
        for node in ast.walk(ast.parse(inspect.getsource(one)))  # type: ignore[arg-type]
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "rule"
    } & set(varied.names())


def test_every_field_that_a_decision_reads_is_varied() -> None:
    read = fields_read(decision, damper.is_organised, inconsistent_runs.kind_of)
    read -= {"part"}  # it decides where the noise is not known; of the cases it always is
    assert read | {"least_excess"} == set(varied.BENCH_VALUES)
    own = (damper.decide_site, damper.lowers, damper.better, damper.equals, damper._rivals)
    read = fields_read(*own, decision.named, inconsistent_runs.kind_of)
    assert read | {"least_excess"} == set(varied.SITE_VALUES)


def test_its_seeds_are_none_that_the_proof_can_draw(capsys: pytest.CaptureFixture[str]) -> None:
    own = trials.make_plan(3, 60, 6)
    assert len(own) == 66
    assert all(one.seed >= plan.RESERVED for one in own)
    assert all(one.seed < plan.RESERVED for one in blind.chosen(3, 60, 6))
    with pytest.raises(SystemExit, match="calibration"):
        blind.main(["--seed", str(plan.RESERVED), "--report"])
    assert trials.make_plan(3, 90, 9)[:60] == own[:60]
    assert trials.make_plan(3, 60, 9)[60:66] == own[60:]


def test_stored_trials_decide_as_the_trials_themselves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trials, "folder", lambda: tmp_path)
    one = case("effect", "gas_spring", 3.0, trial(1.01, "gas_spring"), trial(1.3, "stribeck"))
    one.single[1].losses[:400] *= 3.0
    one.pattern, one.instruments = (0.2, 0.004), ("velocity_sensor",)
    pair = trial(1.0, "gas_spring", "stribeck")
    one.grown["gas_spring"], one.reduced["gas_spring+stribeck"] = [pair], [one.single[0]]
    (again,) = trials.read(trials.keep(one.task, [one]))
    assert (again.task, again.pattern, again.instruments) == (
        one.task,
        (0.2, 0.004),
        one.instruments,
    )
    for rule in (BENCH, replace(BENCH, chance=0.1), replace(BENCH, adequate=1.005)):
        assert page.answer(again, rule) == page.answer(one, rule)
    first = decide(one.before, one.single, one.grow)
    assert decide(again.before, again.single, again.grow).effects == first.effects
    assert again.grow(again.single[0])[0].effects == ("gas_spring", "stribeck")
    with pytest.raises(NotStoredError):
        again.grow(again.single[1])


def test_a_value_trades_false_alarms_against_misses() -> None:
    weak = case("effect", "gas_spring", 1.05, trial(1.02, "gas_spring"))
    chance = case("none", "none", 1.04, trial(1.02, "stribeck"))
    rows = {row.value: row for row in page.traded([weak, chance], BENCH) if row.field == "gain"}
    assert (rows[0.01].alarms, rows[0.01].missed) == ((1, 1), (0, 1))
    assert (rows[0.02].alarms, rows[0.02].missed) == ((0, 1), (0, 1))
    assert (rows[0.05].alarms, rows[0.05].missed) == ((0, 1), (1, 1))


@pytest.mark.parametrize(
    ("kind", "hidden", "said", "effects", "marked"),
    [
        ("none", "none", "unknown", (), ["none", "alarm"]),
        ("fault", "sensor_bias", "none", (), ["none"]),
        ("fault", "sensor_bias", "effect", ("stribeck",), ["none", "alarm"]),
        ("effect", "stribeck", "ambiguous", ("coil_lag", "stribeck"), ["effect"]),
        ("effect", "backlash", "effect", ("presliding",), ["effect"]),
        ("effect", "stribeck", "effect", ("coil_lag",), ["effect", "missed", "wrong"]),
        ("effect", "stribeck", "unknown", (), ["effect", "missed"]),
        ("outside", "ripple", "effect", ("stribeck",), ["outside", "named"]),
        ("pair", "stribeck+coil_lag", "effect", ("coil_lag", "stribeck"), ["pair", "both"]),
        ("pair", "stribeck+coil_lag", "effect", ("stribeck",), ["pair"]),
    ],
)
def test_what_a_verdict_counts_as(
    kind: str, hidden: str, said: str, effects: tuple[str, ...], marked: list[str]
) -> None:
    assert page.marks(case(kind, hidden, 1.0), said, effects) == marked


def test_an_effect_is_hidden_at_the_sites_where_it_acts() -> None:
    stop = case("structure", "end_stop", 3.0, trial(1.01, "end_stop"), site="layer")
    assert page.answer(stop, SITE) == ("effect", ("end_stop",))
    assert page.hidden(stop) == ("end_stop",)
    assert page.hidden(replace(stop, site="storey1")) == ()
    (row,) = [r for r in page.traded([stop], SITE) if (r.field, r.value) == ("share", 0.7)]
    assert row.missed == (0, 1)


def test_what_is_not_stored_is_left_out_and_told() -> None:
    halves = [trial(2.0, "gas_spring"), trial(2.4, "coil_lag")]
    one = case("pair", "gas_spring+coil_lag", 3.0, *halves)
    rows = page.traded([one], BENCH)
    assert all(row.left == 1 for row in rows if row.field == "close")
    assert "left out" in page.table(rows, BENCH)


def test_the_table_goes_between_the_marks_of_a_page(tmp_path: Path) -> None:
    weak = case("effect", "gas_spring", 1.05, trial(1.02, "gas_spring"))
    block = page.text(page.both([weak]), [weak], 0)
    assert "1 cases on the bench, 0 buildings" in block
    assert "| `gain` | 0.005/0.01/**0.02**/0.03/0.05 | 0/0/**0**/1/1 |" in block
    file = tmp_path / "page.md"
    file.write_text(f"head\n{page.BEGIN}\nold\n{page.END}\ntail\n")
    write_between(file, page.BEGIN, page.END, block)
    assert file.read_text() == f"head\n{page.BEGIN}\n\n{block}\n\n{page.END}\ntail\n"
    file.write_text("none")
    with pytest.raises(ValueError, match=r"page\.md: no"):
        write_between(file, page.BEGIN, page.END, block)


def test_without_trials_it_says_how_to_make_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(trials, "folder", lambda: tmp_path)
    assert calibrate.main([]) == 1
    assert "--cases" in capsys.readouterr().err
    assert "not calibrated" in calibrate.run()[0].measured
