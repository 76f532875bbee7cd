"""The blind benchmark counts what its table says; how well anything does is not asked here."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import blind
from benchmarks._blind import (
    building,
    cases,
    forms,
    inseparable,
    methods,
    plan,
    record,
    score,
    subject,
    table,
    work,
)
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
    from bristle.identification.histories import DamperForces
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
    force = DamperForces(law, [effect]).force(*motion, run.step, {**rig.values, **own})
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
    told = {"kind": "ambiguous", "effects": ["gas_spring", "asymmetry"]}
    assert score.names_effect(line({**told, "resolved": {"asymmetry": 0.4}}))
    assert not score.names_effect(line({**told, "resolved": {"asymmetry": 30.0}}))
    assert not score.names_effect(line(told)), "without the test nothing is inseparable"
    assert score.names_effect_or_class(line(told))


def test_an_answer_that_was_stored_as_a_class_counts_as_ambiguous():
    told = {"kind": "class", "effects": ["gas_spring", "asymmetry"]}
    assert score.answer(line(told))["kind"] == "ambiguous"
    assert score.names_effect(line({**told, "resolved": {"asymmetry": 0.4}}))


def test_class_of_four_or_without_the_effect_is_wrong():
    four = ["gas_spring", "asymmetry", "stribeck", "flattening"]
    resolved = dict.fromkeys(four[1:], 0.1)
    assert not score.names_effect(
        line({"kind": "ambiguous", "effects": four, "resolved": resolved})
    )
    told = {"kind": "ambiguous", "effects": ["asymmetry", "stribeck"], "resolved": {}}
    assert not score.names_effect(line(told))


def test_presliding_mount_and_backlash_count_as_one():
    told = {"kind": "ambiguous", "effects": ["backlash", "mount_compliance"]}
    assert score.names_it_alone(line(told, "backlash", "rigid"))
    assert not score.names_it_alone(line(told))
    told["effects"] = ["backlash", "stribeck"]
    assert not score.names_it_alone(line(told, "backlash", "rigid"))


def test_false_alarm_is_anything_but_none():
    for kind in ("effect", "ambiguous", "unknown", "insufficient"):
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


@pytest.mark.slow  # of the generator; a quarter of a minute
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


def test_plan_of_buildings_is_its_own():
    tasks = plan.make_structure_plan(3, 200)
    assert tasks[:40] == plan.make_plan(3, 40, "structure"), "a longer plan begins with the shorter"
    assert len({task.key for task in tasks}) == 200
    assert [task.reconstructed for task in tasks[:4]] == [False, True, False, True]
    for half in (tasks[:200:2], tasks[1:200:2]):
        assert sum(task.effect == "none" for task in half) == 20
        strong = [task for task in half if task.effect != "none"]
        assert sum(task.effect in plan.SITES for task in strong) == 40
        assert Counter(task.strength for task in strong) == {0.15: 40, 0.4: 40}
        assert {task.effect for task in strong} >= {*plan.SITES, "gas_spring", "backlash"}
        assert {(task.rig, task.law) for task in half} == {
            (rig, law) for rig in plan.BUILDINGS for law in ("bingham", "lugre")
        }
    assert not any(task.reconstructed and task.effect == "delay" for task in tasks)
    assert blind.chosen(3, 50, 8) == [*plan.make_plan(3, 50), *tasks[:8]]
    assert blind.chosen(3, 50, 8, "structure") == tasks[:8]
    assert blind.chosen(3, 50, 8, "pair") == plan.make_plan(3, 50, "pair")


def test_a_bench_case_keeps_its_name_and_a_missing_force_changes_it():
    task = Task("pair", "gas_spring+asymmetry", "linear+step", 0.15, 0.01, "bench_10N", "lugre", 7)
    assert task.key == "5757e53fa262fa9f"
    assert Task.of({n: v for n, v in vars(task).items() if n != "reconstructed"}) == task
    assert replace(task, reconstructed=True).key != task.key


def on_building(answer: dict[str, Any], effect: str, late: bool = False, **more: Any) -> Any:
    """Return a finished line of a building; "none" hides nothing."""
    made = line(answer, effect, kind="none" if effect == "none" else "effect", **more)
    made["task"] = {**made["task"], "kind": "structure", "reconstructed": late}
    return made


def test_twins_of_a_reconstructed_force_need_no_test():
    both = {"kind": "ambiguous", "effects": ["gas_spring", "duffing"]}
    assert score.names_in_building(on_building(both, "duffing", late=True))
    assert not score.names_in_building(on_building(both, "duffing")), "a load cell parts them"
    rubs = {"kind": "ambiguous", "effects": ["base_friction"]}
    assert score.names_in_building(on_building(rubs, "base_friction", late=True))
    other = {"kind": "ambiguous", "effects": ["duffing", "gas_spring", "end_stop"]}
    assert not score.names_in_building(on_building(other, "duffing", late=True))
    shown = other | {"resolved": {"end_stop": 1.0, "gas_spring": 9.0}}
    assert score.names_in_building(on_building(shown, "duffing", late=True))
    sure = {"kind": "effect", "effects": ["gas_spring"]}
    assert not score.names_in_building(on_building(sure, "duffing", late=True))
    assert score.tells_twin(on_building(sure, "duffing", late=True))
    assert not score.tells_twin(on_building(both, "duffing", late=True))


def test_rows_of_buildings_are_counted_apart_from_the_bench():
    right = {"kind": "effect", "effects": ["duffing"], "cpu": 12.0}
    lines = [on_building(right, "duffing") for _ in range(9)]
    lines.append(on_building({"kind": "unknown", "cpu": 40.0}, "end_stop"))
    lines.append(on_building(right, "duffing", share=0.04))  # too weak to count
    lines.append(on_building({"kind": "none"}, "none"))
    lines.append(on_building(right, "none", late=True))
    rows = {(row.group, row.name): row for row in table.figures(lines)}
    name = "structure rig, force measured"
    first = rows["main", f"{name}: right, 15 and 40 %"]
    assert (first.counts, first.ratio) == ("9/10", pytest.approx(1.0))
    assert first.interval == pytest.approx((59.58, 98.21), abs=0.01)
    assert rows["main", f"{name}: false alarms on none"].counts == "0/1"
    other = rows["main", "structure rig, force reconstructed: false alarms on none"]
    assert other.counts == "1/1"
    assert other.ratio == float("inf")
    assert rows["main", "single effect right, 15 and 40 %"].counts == "0/0"
    assert rows["main", "false alarms on none"].counts == "0/0"
    assert rows["buildings", "force measured: below 15 %, set aside"].counts == "1/11"
    assert rows["buildings", "one diagnosis, processor, longest, s"].value == 40.0
    assert not any(row.group == "buildings" for row in table.figures([]))


@pytest.mark.slow  # buildings are simulated: task, file and truth agree
def test_a_building_is_recorded_as_its_task_says_and_its_file_is_the_drawing(monkeypatch, tmp_path):
    monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path))
    for late in (False, True):
        task = Task("structure", "none", "", 0.0, 0.01, "structure_10N", "bingham", 7, late)
        case = cases.load(task)
        assert ("force" in case.channels) is not late
        told = building.file_of(case)
        assert [told.M[i][i] for i in range(3)] == case.truth["building"]["masses"]
        assert told.isolated
        runs = subject.measurements(case.part("holdout"), case.channels)
        assert runs[0].has("base_acceleration_absolute", "floor2_velocity", "ground_acceleration")
        # Equal to single precision: kept on disk, and in SI already.
        assert np.allclose(runs[0]["voltage"], case.part("holdout")[0]["voltage"])
        assert work.parts_of(task) == ("diagnosis",)


def test_a_site_is_sought_where_all_rivals_can_act():
    class Found:
        findings = dict.fromkeys(("storey1", "layer", "damper"))
        reconstructed = False

    found: Any = Found()
    assert building._site("duffing", ["base_friction"], found) == "layer"
    assert building._site("storey_softening", [], found) == "storey1"
    assert building._site("stribeck", ["coil_lag"], found) == "damper"
    assert building._site("duffing", ["gas_spring"], found) == "", "at different sites"
    found.findings, found.reconstructed = dict.fromkeys(("storey1", "damper")), True
    assert building._site("duffing", ["gas_spring"], found) == "damper"


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
    assert first.row().measured.startswith("95.0 % (19/20; ")


def test_stlsq_finds_the_terms_that_are_there():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((500, 6))
    target = 0.8 * columns[:, 1] - 0.3 * columns[:, 4] + 0.01 * rng.standard_normal(500)
    theta = methods.stlsq(columns, target, 0.1)
    assert np.flatnonzero(theta).tolist() == [1, 4]
    assert theta[[1, 4]] == pytest.approx([0.8, -0.3], abs=0.01)
    assert not np.any(methods.stlsq(columns, target, 10.0))


def test_correlations_of_white_noise_stay_inside_the_textbook_bounds():
    rng = np.random.default_rng(3)
    n = 20000
    found = methods.correlations(rng.standard_normal(n), [rng.standard_normal(n)])
    assert np.mean(np.abs(found) > 2.58 / np.sqrt(n)) <= 0.06
    walk = np.cumsum(rng.standard_normal(n))
    assert methods.correlations(walk, [])[0] > 0.9


@pytest.mark.parametrize(
    ("effect", "form", "law"),
    [(*key, law) for key in forms.SAME if key[0] in QUICK for law in FORMS[key[0]][key[1]].laws],
)
def test_same_form_with_the_true_values_gives_the_generators_force(effect, form, law):
    """Noise-free, at the sampling rate: two codes that share nothing agree on the law."""
    force, left = compared(effect, form, law)
    assert left < 0.01 * force
