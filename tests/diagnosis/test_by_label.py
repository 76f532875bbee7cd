"""A parameter that depends on a label of the runs is found, told with its size, and carried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bristle.data.run_labels import labels_of
from bristle.diagnosis.by_label import chance_of, confirmed, dependences, extrapolated, together
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.trials import joinable, judge
from bristle.errors import PhysicsError, RecordError
from bristle.identification.fit import fit, refine
from bristle.identification.histories import DamperForces
from bristle.identification.problem import Problem, Run
from bristle.identification.start_grid import initial_guesses
from bristle.model.model import Model
from bristle.physics.damper import DamperModel
from bristle.physics.effect import EFFECTS, laws_joined
from bristle.user_code.load import define, defined, flaw_of

DT, N, NOISE = 0.002, 1500, 0.05
T = DT * np.arange(N)
LAW = {"f_c": 1.3, "f_v": 0.8, "c_0": 60.0, "c_v": 0.0, "k": 70.0, "f_0": 1.0, "v_s": 0.01,
       "delta": 0.0, "x_s": 2e-4}  # fmt: skip
PRESSURES = (50.0, 100.0, 150.0, 100.0, 50.0, 150.0, 100.0, 150.0)


def made(seed, labels, size=1.0, bend=0.0, **own):
    """Return a run of a damper whose yield force is smooth, with values of its own."""
    random = np.random.default_rng(seed)
    w = 2.0 * np.pi * random.uniform(0.4, 4.0, 10)
    length, angle = 0.02 * size / w, w[:, None] * T + random.uniform(0.0, 6.28, (10, 1))
    x, v = length @ np.sin(angle), (length * w) @ np.cos(angle)
    a = -(length * w**2) @ np.sin(angle)
    V = np.repeat(random.choice([0.0, 2.0, 4.0], 10), N // 10)
    p = {**LAW, **own}
    yielding = p["f_c"] + p["f_v"] * V + bend * V**2
    force = yielding * np.tanh(v / p["v_s"]) + p["c_0"] * v + p["k"] * x + p["f_0"]
    force = force + NOISE * random.standard_normal(N)
    return Run(f"run_{seed}", DT, x, v, a, V, force, NOISE, np.zeros((2, N, 4)), labels=labels)


def prepared(runs, train=6, law="tanh"):
    """Return what a diagnosis begins with."""
    fixed = ("c_v", "delta", "x_s", "v_s")
    problems = Problem(list(runs[:train])), Problem(list(runs[train:]))
    base = fit(problems[0], Model(law, (), LAW, fixed), with_std=False).model
    return Prepared(judge(base, *problems), *problems)


def with_pressure(change):
    """Return runs at several pressures, each with values that follow from its own."""
    return [
        made(k, {"pressure_psi": p, "batch": "AABAB"[k % 5], "number": float(k)}, **change(p))
        for k, p in enumerate(PRESSURES)
    ]


def test_what_depends_on_a_label_is_tried_with_its_size_and_no_other_label():
    known = prepared(with_pressure(lambda p: {"f_0": 0.27 * (p - 100.0) / 14.5}))
    (one,) = dependences(known)
    assert (one.name, one.label) == ("f_0_by_pressure_psi", "pressure_psi")
    assert flaw_of(one.name, one.text) == ""
    with defined({one.name: one.text}):
        assert one.name in joinable(known.before.model, problem=known.problem)
        (start,) = initial_guesses(one.name, known.before.model, known.problem)
        trial = judge(refine(start, known.problem), known.problem, known.held_out)
        assert trial.z == pytest.approx(1.0, abs=0.05)
        slope = trial.model.value(f"{one.name}.slope")
        assert slope == pytest.approx(0.27 / 14.5, rel=0.02)
        values = EFFECTS[one.name].values_of({"slope": slope, "middle": 100.0})
        text = EFFECTS[one.name].in_words(values)
    assert text.startswith("The force of the accumulator at mid-stroke (f_0) rises by 0.018")
    assert "N per psi of pressure; the model's value of it is that at 100 psi." in text


def _whole(factor):
    return {name: factor * LAW[name] for name in ("f_c", "f_v", "c_0", "k", "f_0")}


def test_a_label_that_scales_the_whole_force_is_one_dependence():
    known = prepared(with_pressure(lambda p: _whole(1.0 + 0.004 * (p - 100.0))))
    one = dependences(known)[0]
    assert one.name == "force_by_pressure_psi"
    assert flaw_of(one.name, one.text) == ""
    with defined({one.name: one.text}):
        (start,) = initial_guesses(one.name, known.before.model, known.problem)
        trial = judge(refine(start, known.problem), known.problem, known.held_out)
        assert trial.z == pytest.approx(1.0, abs=0.05)
        slope = trial.model.value(f"{one.name}.slope") * 100.0
        middle = trial.model.value(f"{one.name}.middle")
        assert slope / (1.0 + 0.004 * (middle - 100.0)) == pytest.approx(0.4, rel=0.2)
        run, values = known.held_out.runs[0], dict(trial.model.values)
        values |= {f"{one.name}.pressure_psi": run.labels["pressure_psi"]}
        motion = (run.x[9], run.v[9], run.a[9], run.V[9], DT)
        force = DamperForces("tanh", [one.name]).force(*([x] * 2 for x in motion[:4]), DT, values)
        own = DamperModel("tanh", values, [one.name]).force(*motion, 0.0, 0.0, False)
        assert own == pytest.approx(force[0], rel=1e-12)
        text = EFFECTS[one.name].in_words(EFFECTS[one.name].values_of({"slope": 0.004}))
    assert "by one factor, rises by 0.4 % per psi of pressure" in text


def test_a_word_that_scales_the_whole_force_has_a_share_for_each_step():
    oils = ("new", "old", "new", "old", "old", "new", "new", "old")
    runs = [made(k, {"oil": o}, **_whole(1.0 + 0.3 * (o == "old"))) for k, o in enumerate(oils)]
    one = dependences(prepared(runs))[0]
    assert (one.name, flaw_of(one.name, one.text)) == ("force_by_oil", "")
    with defined({one.name: one.text}):
        values = EFFECTS[one.name].values_of({"oil": 2.0, "step[1]": 0.0, "step[2]": 0.3})
        assert "differs from that at oil new by +30 % at oil old" in EFFECTS[one.name].in_words(
            values
        )


def test_a_bend_of_the_command_may_depend_on_a_label():
    runs = with_pressure(lambda p: {"bend": 0.3 + 0.1 * (p - 100.0) / 50.0})
    found = dependences(prepared(runs, law="tanh[quadratic]"))
    (one,) = (one for one in found if one.name == "yield_force_bend_by_pressure_psi")
    assert flaw_of(one.name, one.text) == ""
    with defined({one.name: one.text}):
        joined = laws_joined(EFFECTS[one.name])
        assert "tanh[quadratic]" in joined
        assert "tanh" not in joined


@pytest.mark.parametrize("own", [{}, {"f_0": 3.0}])
def test_a_label_that_nothing_depends_on_is_not_tried(own):
    known = prepared(with_pressure(lambda _p: own))
    assert dependences(known) == []


def test_a_word_has_a_step_and_one_that_was_never_seen_is_refused():
    oils = ("new", "old", "new", "old", "old", "new", "new", "old")
    runs = [made(k, {"oil": one}, c_0=60.0 + 25.0 * (one == "old")) for k, one in enumerate(oils)]
    known = prepared(runs)
    found = dependences(known)
    assert found[0].name == "c_0_by_oil"
    assert flaw_of("c_0_by_oil", found[0].text) == ""
    with defined({"c_0_by_oil": found[0].text}):
        (start,) = initial_guesses("c_0_by_oil", known.before.model, known.problem)
        trial = judge(refine(start, known.problem), known.problem, known.held_out)
        assert trial.model.value("c_0_by_oil.step[2]") == pytest.approx(25.0, rel=0.05)
        assert trial.z == pytest.approx(1.0, abs=0.05)
        values = trial.model.values
        own = {n: values.get(f"c_0_by_oil.{n}", p.value)
               for n, p in EFFECTS["c_0_by_oil"].parameters.items()}  # fmt: skip
        text = EFFECTS["c_0_by_oil"].in_words(EFFECTS["c_0_by_oil"].values_of(own))
        assert "differs from that at oil new by +25" in text
        with pytest.raises(RecordError, match="knows new, old alone"):
            known.problem.predict(trial.model, replace(runs[0], labels={"oil": "other"}))


def test_a_temperature_acts_by_the_law_of_arrhenius():
    warm = (15.0, 38.0, 22.0, 30.0, 26.0, 41.0, 19.0, 34.0)
    B = 1500.0
    runs = [
        made(k, {"temperature": t}, c_0=60.0 * np.exp(B / (t + 273.15) - B / 300.0))
        for k, t in enumerate(warm)
    ]
    found = dependences(prepared(runs))
    assert found[0].name == "c_0_by_temperature"
    assert flaw_of(found[0].name, found[0].text) == ""
    with defined({found[0].name: found[0].text}):
        effect = EFFECTS[found[0].name]
        assert effect.parameters["B"].value == pytest.approx(B, rel=0.2)
        told = effect.in_words(effect.values_of({"B": 900.0, "middle": 26.85}))
    assert "(c_0) falls by 1 % per kelvin, by the law of Arrhenius" in told


def test_what_moves_with_the_motion_is_not_tried_and_the_two_are_told():
    sizes = {50.0: 0.5, 100.0: 1.0, 150.0: 1.5}
    runs = [made(k, {"pressure": p}, sizes[p], f_0=0.02 * p) for k, p in enumerate(PRESSURES)]
    same = [replace(r, v=runs[0].v * sizes[r.labels["pressure"]]) for r in runs]
    (label,) = labels_of([run.labels for run in same])
    assert "the speed" in together(label, same)
    assert dependences(prepared(same)) == []


def found_with(known, names):
    """Return what a diagnosis finds whose trials are those of some effects, the first the best."""
    trials = []
    for name in names:
        (start,) = initial_guesses(name, known.before.model, known.problem)
        trials.append(judge(refine(start, known.problem), known.problem, known.held_out))
    return SiteDiagnosis(
        "damper", "effect", (names[0],), known.before.z, trials[0].z, 1.0, 0.0,
        trials=tuple(trials), before=known.before, after=trials[0], reasons=("It falls.",),
    )  # fmt: skip


def test_labels_that_change_together_are_alternatives_with_the_run_that_separates_them():
    runs = [
        made(k, {"pressure": p, "hose": "ABC"[round(p / 50) - 1]}, f_0=0.02 * p)
        for k, p in enumerate(PRESSURES)
    ]
    known = prepared(runs)
    found = {one.name: one.text for one in dependences(known)}
    assert {*found} == {"f_0_by_pressure", "f_0_by_hose"}
    with defined(found):
        told = confirmed(found_with(known, ["f_0_by_pressure", "f_0_by_hose"]), known)
    assert (told.kind, told.effects) == ("ambiguous", ("f_0_by_pressure", "f_0_by_hose"))
    assert told.reasons[-1] == (
        "Not separable: pressure and hose change together from run to run. A run at pressure 50 "
        "with hose C separates them."
    )


def test_a_dependence_that_hangs_on_one_run_is_unknown():
    known = prepared(with_pressure(lambda _p: {}))
    text = dependences(prepared(with_pressure(lambda p: {"f_0": 0.02 * p})))[0].text
    with defined({"f_0_by_pressure_psi": text}):
        told = confirmed(found_with(known, ["f_0_by_pressure_psi"]), known)
    assert (told.kind, told.effects) == ("unknown", ())
    assert "these runs cannot tell it from chance" in told.reasons[0]
    assert "Measure more runs at each value of the label." in told.reasons[0]


def test_training_runs_all_at_one_level_are_told():
    runs = [made(k, {"hose": "A" if k < 6 else "B"}, f_0=1.0 + (k > 5)) for k in range(8)]
    known = prepared(runs)
    assert dependences(known) == []
    bare = SiteDiagnosis(
        "damper", "unknown", (), known.before.z, known.before.z, 0.0, 0.0,
        before=known.before, after=known.before,
    )  # fmt: skip
    (said,) = confirmed(bare, known).reasons
    assert said == (
        "All training runs are at hose A, and the held-out run_6 at B: nothing that was fitted "
        'tells what hose does. Train on some of both: role = "train" in their [[runs]] of '
        "study.toml."
    )


def test_few_runs_prove_nothing():
    random = np.random.default_rng(1)
    label = np.array([1.0, 2.0, 3.0, 1.0, 2.0])[:, None]
    assert chance_of(random.standard_normal(5), label) > 0.005
    assert chance_of(2.0 * label[:, 0], label) < 1e-6
    assert chance_of(np.array([1.0, 2.0]), label[:2]) == 1.0
    assert dependences(prepared(with_pressure(lambda p: {"f_0": 0.02 * p})[:3], train=2)) == []


def test_a_held_out_run_beyond_what_was_fitted_is_told():
    runs = with_pressure(lambda _p: {})
    known = prepared(runs)
    text = dependences(prepared(with_pressure(lambda p: {"f_0": 0.02 * p})))[0].text
    far = replace(runs[7], labels={"pressure_psi": 200.0})
    with defined({"f_0_by_pressure_psi": text}):
        model = replace(known.before.model, effects=("f_0_by_pressure_psi",))
        (said,) = extrapolated(model, runs[:6], [runs[6], far])
        assert extrapolated(model, runs[:6], runs[6:]) == []
    assert said == (
        "Extrapolation: the training runs have pressure 50 psi to 150 psi, beyond which lies run_7 "
        "(200 psi): nothing was fitted there."
    )


FILE = '''"""A preload."""

from bristle.physics.effect import Effect, Parameter


class Own(Effect):
    """A preload that depends on the pressure."""

    name = "own_preload"
    sites = ("damper",)
    needs = ("value",)
    changes = "{changes}"
    passive = True
    source = expect = "-"
    assumed = ("pressure", "middle")
    labels = {{"pressure": "pressure"}}
    label_means = {{"middle": "pressure"}}
    parameters = {{
        "slope": Parameter(0.01, "N", (-1.0, 1.0), "per unit"),
        "pressure": Parameter(150.0, "1", (-1e6, 1e6), "of the run"),
        "middle": Parameter(100.0, "1", (-1e6, 1e6), "of all runs"),
    }}

    @staticmethod
    def changed(q, z, p):
        return q.value + p.slope * (p.pressure - p.middle)
'''


def test_a_changed_parameter_is_the_same_in_a_fit_and_in_a_component():
    x, v, a, V = (np.array([1e-3, 2e-3]), np.full(2, 0.05), np.zeros(2), np.zeros(2))
    values = {**LAW, "own_preload.slope": 0.02}
    with defined({"own_preload": FILE.format(changes="f_0")}):
        plain = DamperForces("tanh", []).force(x, v, a, V, DT, LAW)
        changed = DamperForces("tanh", ["own_preload"]).force(x, v, a, V, DT, values)
        assert changed - plain == pytest.approx([1.0, 1.0])
        one = DamperModel("tanh", values, ["own_preload"])
        force = one.force(1e-3, 0.05, 0.0, 0.0, DT, 0.0, 0.0, False)
        assert force == pytest.approx(changed[0], rel=1e-12)
        assert not one.active  # the law steps alone, as fast as without
        assert not EFFECTS["own_preload"].joins(Model("dahl").law_class)


def test_what_changes_no_parameter_of_a_damper_is_refused():
    wrong = FILE.format(changes="f_0").replace('    needs = ("value",)\n    changes = "f_0"\n', "")
    wrong = wrong.replace("q.value +", "")
    with pytest.raises(PhysicsError, match="changes and the hook `changed` go together"):
        define("own_preload", wrong)
