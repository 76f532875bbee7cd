"""The blind benchmark counts what its table says; how well anything does is not asked here."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import peers
from benchmarks._blind import forms, inseparable, plan, record, score, table
from benchmarks._blind.plan import Task
from tests.independent import generate
from tests.independent.effects import FORMS

QUICK = (
    "stribeck", "flattening", "quadratic_damping", "asymmetry", "gas_spring", "fluid_inertia",
    "coil_lag", "saturation",
)  # fmt: skip
"""Effects without a joint and without much of a past: their laws agree sample by sample."""


def compared(effect: str, form: str, law: str) -> tuple[float, float]:
    """Return RMS of the generator's force and of what the package's law leaves of it [N]."""
    from bristle.compiled.bench import Bench
    from tests.independent.experiments import bench_experiment
    from tests.independent.rigs import draw_rig
    from tests.independent.specimen import Specimen

    rig = draw_rig("bench_10N", law, np.random.default_rng(3))
    fields = FORMS[effect][form].fields(0.1, np.random.default_rng(5), rig, {})
    run = bench_experiment(rig, np.random.default_rng(4), "multisine", "sine", duration=4.0)
    seen = Specimen(rig, fields, rtol=1e-7).answer(run)
    own = forms.true_values({"effect": effect, "form": form, "parameters": fields}, rig.force)
    assert own is not None
    motion = [seen[name] for name in ("displacement", "velocity", "acceleration", "voltage")]
    force = Bench(law, [effect]).force(*motion, run.step, {**rig.values, **own})
    left = force - seen["force_shown"]
    return float(np.sqrt(np.mean(seen["force_shown"] ** 2))), float(np.sqrt(np.mean(left**2)))


def line(
    answer: dict[str, Any],
    effect: str = "gas_spring",
    form: str = "linear",
    *,
    kind: str = "effect",
    share: float = 0.15,
    law: str = "lugre",
    parameters: dict[str, float] | None = None,
    fault: dict[str, Any] | None = None,
    noise: float = 0.01,
) -> dict[str, Any]:
    """Return a finished line as the workers write it."""
    names = (
        []
        if kind in ("none", "fault")
        else list(zip(effect.split("+"), form.split("+"), strict=True))
    )
    hidden = [
        {
            "effect": one,
            "form": shape,
            "bound": "",
            "parameters": parameters or {"gas_k": 100.0, "gas_kind": 1},
        }
        for one, shape in names
    ]
    task = Task(kind, effect, form, 0.15, noise, "bench_10N", law, 1)
    told = {"kind": "none", "effects": [], "sensors": [], "coordinate": "", "ranking": []}
    truth = {
        "base": {"v_n": 0.02},
        "scales": {"force": 10.0},
        "effects": hidden,
        "fault": fault,
        "share": share,
        "wanted": 0.15,
    }
    return {"task": vars(task), "truth": truth, "answer": told | answer}  # fmt: skip


# Newcombe (1998), Statistics in Medicine 17, 857-872, Table I, method 3 (score, uncorrected).
@pytest.mark.parametrize(
    ("good", "of", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_interval_as_published(good, of, low, high):
    assert score.wilson(good, of) == pytest.approx((low, high), abs=5e-5)


def test_wilson_of_nothing_knows_nothing():
    assert score.wilson(0, 0) == (0.0, 1.0)


def test_single_effect_must_be_the_whole_verdict():
    assert score.names_effect(line({"kind": "effect", "effects": ["gas_spring"]}))
    assert not score.names_effect(line({"kind": "effect", "effects": ["stribeck"]}))
    assert not score.names_effect(line({"kind": "effect", "effects": ["gas_spring", "stribeck"]}))
    assert not score.names_effect(line({"kind": "unknown"}))
    assert not score.names_effect({**line({}), "answer": None, "error": "it broke"})


def test_class_counts_only_if_the_separate_test_finds_it_inseparable():
    told = {"kind": "class", "effects": ["gas_spring", "asymmetry"]}
    assert score.names_effect(line({**told, "resolved": {"asymmetry": 0.4}}))
    assert not score.names_effect(line({**told, "resolved": {"asymmetry": 30.0}}))
    assert not score.names_effect(line(told)), "without the test nothing is inseparable"
    assert score.names_effect_or_class(line(told))


def test_class_of_four_or_without_the_effect_is_wrong():
    four = ["gas_spring", "asymmetry", "stribeck", "flattening"]
    resolved = dict.fromkeys(four[1:], 0.1)
    assert not score.names_effect(line({"kind": "class", "effects": four, "resolved": resolved}))
    told = {"kind": "class", "effects": ["asymmetry", "stribeck"], "resolved": {}}
    assert not score.names_effect(line(told))


def test_presliding_mount_and_backlash_count_as_one():
    told = {"kind": "class", "effects": ["backlash", "mount_compliance"]}
    assert score.names_it_alone(line(told, "backlash", "rigid"))
    assert not score.names_it_alone(line(told))
    told["effects"] = ["backlash", "stribeck"]
    assert not score.names_it_alone(line(told, "backlash", "rigid"))


def test_false_alarm_is_anything_but_none():
    for kind in ("effect", "class", "unknown", "insufficient"):
        assert score.false_alarm(line({"kind": kind}, kind="none"))
    fault = {"channel": "force", "fault": "bias", "value": 1.0}
    assert score.false_alarm(line({"kind": "none", "sensors": [fault]}, kind="none"))
    assert not score.false_alarm(line({"kind": "none"}, kind="none"))


def test_outside_effect_needs_unknown_and_its_coordinate():
    hidden = {"effect": "force_ripple", "form": "detent", "kind": "outside"}
    right = line({"kind": "unknown", "coordinate": "displacement"}, **hidden)
    assert score.calls_unknown(right)
    assert score.coordinate_right(right)
    assert not score.coordinate_right(line({"kind": "unknown", "coordinate": "voltage"}, **hidden))
    assert not score.coordinate_right(
        line({"kind": "none", "coordinate": "displacement"}, **hidden)
    )


def test_sensor_fault_needs_channel_and_kind_and_no_effect():
    planted = {"kind": "sensor_delay", "channel": "velocity", "value": 0.01}
    told = {"channel": "velocity", "fault": "delay", "value": 0.01}

    def reported(answer: dict[str, Any], fault: dict[str, Any] = planted) -> bool:
        return score.reports_fault(line(answer, fault["kind"], kind="fault", fault=fault))

    assert reported({"sensors": [told]})
    assert not reported({"sensors": [told], "kind": "effect", "effects": ["coil_lag"]})
    assert not reported({"sensors": [{**told, "channel": "displacement"}]})
    assert not reported({"sensors": [{**told, "fault": "gain"}]})
    gain = {**planted, "kind": "sensor_gain"}
    assert reported({"sensors": [{**told, "fault": "gain", "channel": "displacement"}]}, gain)


def test_pairs():
    pair = {"effect": "gas_spring+asymmetry", "form": "linear+step", "kind": "pair"}
    both = line({"kind": "effect", "effects": ["asymmetry", "gas_spring"]}, **pair)
    one = line({"kind": "effect", "effects": ["asymmetry"]}, **pair)
    wrong = line({"kind": "effect", "effects": ["asymmetry", "stribeck"]}, **pair)
    assert [score.names_both(x) for x in (both, one, wrong)] == [True, False, False]
    assert [score.names_one_at_least(x) for x in (both, one, wrong)] == [True, True, False]


def test_strengths_are_binned_by_what_was_reached():
    shares = [0.01, 0.05, 0.08, 0.12, 0.3]
    assert [score.bin_of(line({}, share=s)) for s in shares] == ["", "5 %", "5 %", "15 %", "40 %"]
    short = line({}, share=0.1)
    short["truth"]["effects"][0]["bound"] = "most"
    assert score.unreachable(short)
    assert not score.unreachable(line({}, share=0.1))


def test_intervals_are_held_against_the_generators_numbers():
    told = {"kind": "effect", "effects": ["gas_spring"]}
    best = {"gas_spring.k": [103.0, 2.0], "v_n": [0.03, 0.001], "gas_spring.k_2": [1.0, 1.0]}
    rows = {
        name: (covers, wide) for name, covers, wide in score.intervals(line({**told, "best": best}))
    }
    assert rows["gas_spring.k"] == (True, pytest.approx(2 * 1.959964 * 2.0 / 100.0))
    assert rows["v_n"][0] is False
    assert "gas_spring.k_2" not in rows, "its true value is zero"
    other = line({**told, "best": best}, form="polytropic")
    assert score.intervals(other) == []


def test_every_form_that_is_called_the_same_is_one_of_the_generators():

    for effect, form in forms.SAME:
        assert form in FORMS[effect]
    other = {e for e, group in FORMS.items() if any(not forms.is_same(e, f) for f in group)}
    assert {"stribeck", "presliding", "backlash", "temperature", "saturation"} <= other


def test_every_fault_of_the_plan_is_planted_on_its_channel():
    for task in plan.make_plan(5, 30, "fault"):
        made = generate.make_case(
            task.seed,
            task.effect,
            task.form,
            task.strength,
            rig=task.rig,
            law=task.law,
            duration=1.0,
        )
        assert made.fault is not None
        assert (made.fault.kind, made.fault.channel) == (task.effect, task.form)


def test_plan_holds_its_promises():
    tasks = plan.make_plan(3, 480)
    assert tasks[:50] == plan.make_plan(3, 50), "a longer plan begins with the shorter one"
    assert len({task.key for task in tasks}) == 480
    at_one = [task for task in tasks if task.noise == 0.01]
    assert len(at_one) == 400
    assert Counter(task.kind for task in at_one)["none"] == 150
    single = Counter(task.effect for task in tasks if task.kind == "effect")
    assert max(single.values()) - min(single.values()) <= 1
    assert not any((t.effect, t.form) in plan.INVISIBLE for t in tasks)
    assert plan.make_plan(4, 50) != tasks[:50]
    assert {task.kind for task in plan.make_plan(3, 5, "pair")} == {"pair"}
    with pytest.raises(ValueError, match="none, effect"):
        plan.make_plan(3, 5, "nothing")


def test_resolution_is_that_of_the_likelihood_ratio():
    rng = np.random.default_rng(1)
    n, noise = 4000, 0.5
    rival = 0.05 * np.sin(np.arange(n) * 0.01)
    true, quiet = np.zeros(n), np.zeros((2, n))
    found = inseparable.resolution([true], [rival], [np.full(n, noise)], [quiet], [noise])
    drawn = []
    for _ in range(400):
        y = noise * rng.standard_normal(n)
        drawn.append(np.sum((y - rival) ** 2 - y**2) / (2.0 * noise**2))
    assert found == pytest.approx(np.mean(drawn) / np.std(drawn), rel=0.15)
    assert inseparable.resolution([true], [true], [np.full(n, noise)], [quiet], [noise]) == 0.0


def test_noise_that_is_common_to_samples_resolves_less():
    n = 1000
    rival = [np.full(n, 0.1)]
    sigma, quiet = [np.ones(n)], [np.zeros((4, n))]
    moved = [np.repeat(np.array([[1.0], [-1.0], [1.0], [-1.0]]), n, axis=1)]
    alone = inseparable.resolution([np.zeros(n)], rival, sigma, quiet, [1.0])
    assert inseparable.resolution([np.zeros(n)], rival, sigma, moved, [1.0]) < 0.1 * alone


def test_record_keeps_whole_lines_of_the_code_at_hand(tmp_path: Path):
    path = tmp_path / "record.jsonl"
    record.append(path, {"part": "peers", "key": "a", "digest": "new", "x": np.float64(1.0)})
    record.append(path, {"part": "peers", "key": "b", "digest": "old"})
    with path.open("a") as file:
        file.write(json.dumps({"part": "peers", "key": "c"})[:-5])  # killed in the middle of a line
    assert list(record.finished(path, {"peers": "new"})["peers"]) == ["a"]


def test_table_counts_and_marks():
    lines = [line({"kind": "effect", "effects": ["gas_spring"], "z_after": 1.0}) for _ in range(19)]
    lines.append(line({"kind": "unknown"}))
    lines.append(line({"kind": "effect", "effects": ["stribeck"]}, kind="none"))
    rows = {row.name: row for row in table.figures(lines) if row.group == "main"}
    first = rows["single effect right, 15 and 40 %"]
    assert (first.counts, first.value) == ("19/20", 95.0)
    assert first.ratio == pytest.approx(1.0)
    assert rows["false alarms on none"].ratio == float("inf")
    assert rows["library effect called unknown"].counts == "1/20"
    assert rows["single effect right, 5 %"].value is None
    assert "| single effect right, 15 and 40 % | 95.0 % | 19/20 |" in table.markdown([first])


def test_stlsq_finds_the_terms_that_are_there():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((500, 6))
    target = 0.8 * columns[:, 1] - 0.3 * columns[:, 4] + 0.01 * rng.standard_normal(500)
    theta = peers.stlsq(columns, target, 0.1)
    assert np.flatnonzero(theta).tolist() == [1, 4]
    assert theta[[1, 4]] == pytest.approx([0.8, -0.3], abs=0.01)
    assert not np.any(peers.stlsq(columns, target, 10.0))


def test_correlations_of_white_noise_stay_inside_the_textbook_bounds():
    rng = np.random.default_rng(3)
    n = 20000
    found = peers.correlations(rng.standard_normal(n), [rng.standard_normal(n)])
    assert np.mean(np.abs(found) > 2.58 / np.sqrt(n)) <= 0.06
    walk = np.cumsum(rng.standard_normal(n))
    assert peers.correlations(walk, [])[0] > 0.9


@pytest.mark.parametrize(
    ("effect", "form", "law"),
    [(*key, law) for key in forms.SAME if key[0] in QUICK for law in FORMS[key[0]][key[1]].laws],
)
def test_same_form_with_the_true_values_gives_the_generators_force(effect, form, law):
    """Noise-free, at the sampling rate: two codes that share nothing agree on the law."""
    force, left = compared(effect, form, law)
    assert left < 0.01 * force
