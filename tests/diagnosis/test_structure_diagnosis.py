"""A building's hidden effects are named at their site, and what looks alike is named with them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shaken import building, friction, measured, shake

from bristle.core.finding import Finding
from bristle.core.progress import telling
from bristle.diagnosis import diagnose_rig, rig_runs
from bristle.diagnosis import site as of_damper
from bristle.diagnosis.conclusion import VerdictContext, conclude, lookalikes
from bristle.diagnosis.decision import Decision
from bristle.diagnosis.inconsistent_runs import kind_of
from bristle.diagnosis.load_cell import load_cell
from bristle.diagnosis.prepared import Prepared
from bristle.diagnosis.rule import BENCH, INSIDE
from bristle.diagnosis.site import diagnose_line, prepare_line, shortened
from bristle.diagnosis.site_diagnosis import SiteDiagnosis, of_decision
from bristle.diagnosis.trials import Trial, judge
from bristle.errors import RecordError
from bristle.identification.building_motion import responses
from bristle.identification.building_sites import StructureProblem, problems_of
from bristle.model.model import Model
from bristle.physics.effect import EFFECTS


def duffing(x, v):
    return [1.5e7 * x[0] ** 3, 0.0, 0.0]


def rub(x, v):
    return [0.6 * np.tanh(v[0] / 1e-4), 0.0, 0.0]


def stop(x, v):
    return [6e3 * np.sign(x[0]) * max(abs(x[0]) - 0.003, 0.0), 0.0, 0.0]


def soften(x, v):
    drift = np.diff(x, prepend=0.0)
    # What the linear spring has too much; from a tanh, not from the library's own form.
    loss = 1400.0 * (0.003 * np.tanh(drift / 0.003) - drift)
    loss[0] = 0.0
    return [loss[0] - loss[1], loss[1] - loss[2], loss[2]]


NOTHING = SiteDiagnosis("layer", "none", (), 1.0, 1.0, 0.0, 0.0)
HIDDEN = {"duffing": duffing, "base_friction": rub, "end_stop": stop, "storey_softening": soften}


def runs_of(hidden, seed=20, damper=friction, count=3):
    b = building(2, True, 6)
    return b, [measured(shake(b, seed + i, damper, hidden), i) for i in range(count)]


@cache
def findings(hidden):
    b, runs = runs_of(hidden)
    found = responses(runs, b)
    problems = problems_of(found[:2], found[2:], b)
    lines = {s: prepare_line(s, *problems[s]) for s in ("layer", "storey1", "storey2")}
    return {site: diagnose_line(site, one) for site, one in lines.items()}, found, b


@pytest.mark.parametrize("effect", HIDDEN)
def test_the_hidden_effect_is_named_at_its_site(effect):
    found, _, _ = findings(HIDDEN[effect])
    sites = ("storey1", "storey2") if effect == "storey_softening" else ("layer",)
    for site, finding in found.items():
        expected = (effect,) if site in sites else ()
        assert finding.effects == expected, (site, finding)
        if site in sites:
            assert finding.kind == "effect"
            assert finding.share > 0.9
            assert finding.z_after < 0.8 * finding.z_before
        else:
            assert finding.kind == "none"
            assert finding.z_before == pytest.approx(1.0, abs=0.06)


def test_nothing_is_found_where_nothing_is_hidden():
    found, _, _ = findings(None)
    assert [f.kind for f in found.values()] == ["none"] * 3


@pytest.mark.slow  # every effect of a building is tried in vain
def test_a_force_of_no_effect_is_unknown_and_its_coordinate_named():
    def ripple(x, v):
        return [0.4 * np.sin(2.0 * np.pi * x[0] / 0.002), 0.0, 0.0]

    b, runs = runs_of(ripple)
    found = diagnose_rig(runs[:2], runs[2:], Model("lugre"), b)
    assert found.findings["layer"].kind == "unknown"
    assert (found.kind, found.coordinate) == ("unknown", "displacement")
    assert "The remaining error depends mainly on displacement." in found.words


@pytest.mark.parametrize(
    ("what", "value"),  # a second each
    [("delay", 0.008), pytest.param("force_gain", 1.15, marks=pytest.mark.slow)],
)
def test_a_load_cell_that_is_late_or_wrong_is_told_from_physics(what, value):
    b = building(2, True, 6)
    runs = []
    for i in range(3):
        clean = shake(b, 30 + i, friction)
        if what == "delay":
            late = round(value / 0.002)
            clean["force"] = np.concatenate([np.zeros(late), clean["force"][:-late]])
        else:
            clean["force"] = clean["force"] * value
        runs.append(measured(clean, i))
    found = responses(runs, b)
    problems = problems_of(found[:2], found[2:], b)
    layer = diagnose_line("layer", prepare_line("layer", *problems["layer"]))
    told = load_cell(layer, found[:2], found[2:], b)
    assert told is not None
    finding, (train, _) = told
    assert finding.effects == (what,)
    assert float(finding.coordinate.split()[0]) == pytest.approx(value, rel=0.03)
    assert finding.z_after == pytest.approx(1.0, abs=0.1)
    scale = 1.0 if what == "delay" else value
    assert np.std(train[0].force) == pytest.approx(np.std(found[0].force) / scale, rel=0.02)


def test_a_real_effect_is_not_blamed_on_the_load_cell():
    found, all_runs, b = findings(duffing)
    assert load_cell(found["layer"], all_runs[:2], all_runs[2:], b) is None


def test_bare_building_diagnosed_from_start_to_end():
    b, runs = runs_of(duffing, damper=None)
    said = []
    with telling(said.append):
        found = diagnose_rig(runs[:2], runs[2:], Model("lugre"), b)
    assert (found.kind, found.effects) == ("effect", ("duffing",))
    assert found.sites == {"duffing": "layer"}
    assert not found.reconstructed
    assert "Duffing spring (isolation layer)" in found.words
    assert said[0].startswith("looking for sensor faults")
    assert said[1].startswith("smoothing")
    answer = found.as_dict()
    assert answer["ranking"][0]["effect"] == "duffing"
    assert answer["z_holdout_after"] == pytest.approx(1.0, abs=0.1)
    assert answer["z_holdout_before"] > 1.5
    sites = {found["site"]: found for found in answer["findings"]}
    assert list(sites) == list(found.findings)
    assert "layer" in sites
    assert all(0.0 < one["detectable"] < 0.05 for one in sites.values())
    k_3 = sites["layer"]["values"]["duffing.k_3"]
    assert 0.0 < k_3["std"] < 0.2 * abs(k_3["value"])
    assert found.std["duffing.k_3"] == k_3["std"]
    assert sites["layer"]["organised"][0]["coordinate"] == "displacement"
    assert all("organised" not in one for site, one in sites.items() if site != "layer")
    assert set(answer["noise_floor"]) >= {"base_displacement", "ground_acceleration"}


def test_runs_of_two_buildings_contradict_each_other_at_the_site_that_differs():
    b = building(2, True, 6)
    other = lambda x, v: [400.0 * x[0], 0.0, 0.0]  # noqa: E731 a stiffer layer
    runs = [measured(shake(b, 40 + i, None, None if i % 2 else other), i) for i in range(4)]
    found = diagnose_rig(runs[:2], runs[2:], Model("lugre"), b)
    assert found.findings["layer"].kind == "insufficient"
    assert found.kind == "insufficient"
    assert "At the isolation layer: one model does not explain all runs together" in found.words
    assert [found.findings[site].kind for site in ("storey1", "storey2")] == ["none", "none"]


@pytest.mark.parametrize(
    ("kind", "train", "best", "now"),
    [
        ("unknown", 1.05, 1.05, "insufficient"),
        ("unknown", 1.3, 1.3, "unknown"),
        ("none", 1.2, 1.2, "insufficient"),
        ("none", 1.1, 1.1, "none"),
        ("effect", 1.3, 1.0, "effect"),
    ],
)
def test_a_verdict_needs_runs_that_agree(kind, train, best, now):
    assert kind_of(kind, trial((), 1.3, train), trial((), 1.0, best)) == now


def test_what_a_reconstructed_force_cannot_tell_is_named():
    assert list(lookalikes(("gas_spring",))) == ["duffing"]
    assert lookalikes(("duffing", "gas_spring")) == {}
    assert list(lookalikes(("fluid_inertia",))) == [
        "a mass of the base that the file does not know"
    ]
    assert list(lookalikes(("base_friction",))) == ["f_c of the damper"]
    assert lookalikes(("stribeck",)) == {}


def test_findings_of_sites_become_one_verdict():
    def at(site, kind, *effects):
        return SiteDiagnosis(site, kind, effects, 3.0, 1.0, 1.0, 0.01, coordinate="velocity")

    both = {"layer": at("layer", "effect", "duffing"), "storey1": at("storey1", "none")}
    assert conclude(both, VerdictContext()).effects == ("duffing",)
    both["storey1"] = at("storey1", "effect", "storey_softening")
    found = conclude(both, VerdictContext())
    assert (found.kind, found.effects) == ("effect", ("duffing", "storey_softening"))
    both["storey1"] = at("storey1", "unknown")
    found = conclude(both, VerdictContext())
    assert (found.kind, found.coordinate) == ("unknown", "velocity")
    assert "Missing besides: Duffing spring (isolation layer)." in found.words


def seen(site, kind, before, *effects):
    """Return what a site shows, with z before."""
    return SiteDiagnosis(site, kind, effects, before, 1.0, 1.0, 0.01, reasons=("Because.",))


def test_what_is_found_is_named_whatever_a_quiet_site_does():
    for kind, *effects in (("unknown",), ("insufficient",), ("effect", "base_friction")):
        sites = {
            "layer": seen("layer", kind, 1.17, *effects),
            "damper": seen("damper", "effect", 6.28, "flattening"),
        }
        found = conclude(sites, VerdictContext())
        assert (found.kind, found.effects) == ("effect", ("flattening",))
        assert "little beside what was found: Because." in found.words


def test_a_loud_site_without_a_name_stays_unknown_beside_a_finding():
    sites = {
        "layer": seen("layer", "unknown", 2.0),
        "damper": seen("damper", "effect", 3.0, "flattening"),
    }
    assert conclude(sites, VerdictContext()).kind == "unknown"


@pytest.mark.parametrize("name", ["fluid_inertia", "base_friction"])
def test_an_ambiguous_verdict_has_two_names_that_can_be_added(name):
    sites = {"damper": seen("damper", "effect", 7.41, name)}
    found = conclude(sites, VerdictContext(force="reconstructed"))
    assert (found.kind, found.effects) == ("effect", (name,))
    assert all(one not in EFFECTS for one in found.alternatives)
    assert "a load cell at the damper would distinguish them" in found.words
    twins = {"damper": seen("damper", "effect", 7.41, "gas_spring")}
    both = conclude(twins, VerdictContext(force="reconstructed"))
    assert (both.kind, both.effects) == ("ambiguous", ("gas_spring", "duffing"))


def test_an_effect_whose_place_no_load_cell_tells_is_named_all_the_same():
    sites = {"damper": seen("damper", "effect", 7.41, "end_stop")}
    found = conclude(sites, VerdictContext(force="reconstructed"))
    assert (found.kind, found.effects) == ("effect", ("end_stop",))
    assert found.alternatives == ("end_stop@damper",)
    assert "a load cell at the damper would distinguish them" in found.words


def test_each_run_has_the_noise_of_its_own_instruments():
    b = building(2, True, 6)
    runs = [measured(shake(b, 20 + i), i) for i in range(3)]
    rng = np.random.default_rng(3)
    loud = {
        n: v + 3.0 * runs[0].noise.get(n, 0.0) * rng.standard_normal(len(v))
        for n, v in runs[0].channels.items()
    }
    noise = {name: 3.0 * value for name, value in runs[0].noise.items()}
    found = responses([replace(runs[0], channels=loud, noise=noise), *runs[1:]], b)
    wide = [float(np.std(one.draws[1][:, :, 0])) for one in found]
    assert wide[0] > 1.8 * wide[1]


def test_missing_channels_are_named():
    b, runs = runs_of(None, count=1)
    clean = shake(b, 20, friction, samples=1000)
    bad = measured(clean, 0, without=("ground_acceleration", "base_displacement", "base_velocity"))
    with pytest.raises(
        RecordError, match="missing ground_acceleration, and base_displacement or base_velocity"
    ):
        diagnose_rig([bad], runs, Model("lugre"), b)


def test_late_velocity_of_the_base_is_a_sensor_fault_and_not_physics():
    b = building(2, True, 6)
    runs = []
    for i in range(3):
        clean = shake(b, 20 + i)
        late = 4
        clean["base_velocity"] = np.concatenate([np.zeros(late), clean["base_velocity"][:-late]])
        runs.append(measured(clean, i))
    found = diagnose_rig(runs[:2], runs[2:], Model("lugre"), b)
    (fault,) = found.sensors
    assert (fault.channel, fault.kind) == ("velocity", "delay")
    assert fault.value == pytest.approx(4 * 0.002, rel=0.05)
    assert (found.kind, found.effects) == ("none", ())
    assert found.z_before == pytest.approx(1.0, abs=0.1)


def test_lag_of_a_velocity_is_its_instrument():
    lag = Finding("lag", "warning", "Velocity lags.", channel="velocity", value=0.004, std=1e-4)
    found = conclude({"layer": NOTHING}, VerdictContext(sensors=(lag,)))
    assert (found.kind, found.effects) == ("effect", ("velocity_sensor",))
    assert found.sites == {"velocity_sensor": "sensor"}
    assert "velocity sensor (sensor)" in found.words


def trial(effects=(), z=1.0, train=1.0, losses=None):
    lost = np.full(4000, 0.5 * z * z) if losses is None else losses
    return Trial(Model("lugre", effects), train, z, 1.0, lost, np.sqrt(2.0 * lost))


@pytest.mark.parametrize(
    ("z", "train", "searched"), [(1.0, 1.0, 0), (1.04, 1.0, 1), (1.0, 1.04, 1)]
)
def test_effects_of_the_damper_are_searched_only_where_one_could_matter(
    monkeypatch, z, train, searched
):
    asked = []

    def search(*given, **_more):
        asked.append(given)
        return [trial(("gas_spring",), z)]

    monkeypatch.setattr(of_damper, "try_all", search)
    none = StructureProblem([])
    inside = Prepared(trial((), z, train), none, none, part=none, rule=INSIDE, bench=False)
    found, _ = of_damper.diagnose_damper(inside)
    assert len(asked) == searched
    assert found.kind == "none"
    assert BENCH.quiet < 1.02, (
        "above that an effect could lower z by its smallest share to that of noise"
    )


def test_a_stop_that_is_met_once_is_told_by_its_likelihood():
    quiet = np.full(40000, 0.45)
    hit = quiet.copy()
    hit[5000:5040] = 60.0  # one contact in one held-out run
    before = trial((), 1.3, losses=hit)
    stop = trial(("end_stop",), 0.99, losses=quiet)
    spring = trial(("duffing",), 1.29, losses=hit * 0.999)
    decision = of_damper._rare(before, [stop, spring])
    assert decision is not None
    assert (decision.kind, decision.effects) == ("effect", ("end_stop",))
    assert decision.explained > 0.95
    close = trial(("duffing",), 0.991, losses=quiet * 1.0001)
    assert of_damper._rare(before, [stop, close]).effects == ("end_stop", "duffing")
    assert of_damper._rare(before, [trial(("gas_spring",), 0.99, losses=quiet)]) is None
    poor = trial(("end_stop",), 1.25, losses=hit * 0.99)
    assert of_damper._rare(before, [poor]) is None


def test_what_dry_friction_holds_at_rest_judges_no_effect():
    b, runs = runs_of(duffing)
    found = responses(runs, b)
    train, held_out = problems_of(found[:2], found[2:], b, "bingham")["damper"]
    run = held_out.runs[0]
    rest = np.ones(len(run.whole.force), dtype=bool)
    rest[run.keep] = False
    assert rest[run.whole.skip :].any()
    whole = replace(run.whole, force=run.whole.force + 1e3 * rest)
    pushed = held_out.of([replace(run, whole=whole)])
    one, other = (judge(Model("bingham"), train, held) for held in (held_out, pushed))
    assert other.rms == one.rms
    assert other.error.rms > 2.0 * one.error.rms, "the error that is told has all samples"


def test_only_what_an_instrument_accounts_for_is_excused_by_sensor():
    def judged(z, gain):
        before = trial((), z)
        unknown = Decision("unknown", (), before, 0.0, ("z.",))
        found = of_decision(unknown, before, (trial(("stribeck",), z * (1.0 - gain)),))
        return of_damper.excused_by_sensor(found, 1.25, "Blurred.").kind

    assert judged(1.19, 0.001) == "none"
    assert judged(1.19, 0.1) == "unknown", "an effect explains it in part"
    assert judged(1.6, 0.001) == "unknown", "more than the instrument accounts for"
    before = trial((), 1.02, train=1.2)
    found = of_decision(Decision("none", (), before, 0.0, ("z.",)), before)
    excused = of_damper.excused_by_sensor(found, 1.25, "Blurred.")
    assert excused.kind == "none"
    assert "1.20 times" in excused.reasons[0], "what it leaves of some runs contradicts nothing"
    quiet = replace(found, before=trial((), 1.02))
    assert of_damper.excused_by_sensor(quiet, 1.25, "Blurred.") is quiet


def test_a_load_cell_that_rounds_is_put_on_the_model_and_not_taken_back():
    def told(effect, z):
        return SiteDiagnosis("force", "effect", (effect,), 4.0, z, 0.9, 0.01, coordinate="0.0125 s")

    assert rig_runs._rounded(told("delay", 1.9))
    assert not rig_runs._rounded(told("delay", 1.02)), "moved ahead it fits: a plain delay"
    assert not rig_runs._rounded(told("force_gain", 1.9))
    model = rig_runs._late(Model("lugre", ("gas_spring",)), told("delay", 1.9))
    assert model.effects == ("gas_spring", "delay")
    assert model.value("delay.time") == 0.0125


@pytest.mark.parametrize("law", ["bingham", "lugre"])
def test_shortened_runs_are_the_begin_of_the_whole_ones(law):
    b, runs = runs_of(None, count=2)
    found = responses(runs, b)
    problem = problems_of(found[:1], found[1:], b, law)["damper"][0]
    assert shortened(problem, 10.0) is problem
    brief = shortened(problem, 4.0)
    (run,), (long,) = brief.runs, problem.runs
    count = len(run.x)
    assert len(run.whole.x) == 2000
    assert 0 < count <= 2000
    assert run.keep[-1] < 2000
    assert np.array_equal(run.force, long.force[:count])
    values = {"sigma_a": 900.0, "a_0": 600.0, "f_c": 1.5}
    model = Model(law, (), {n: v for n, v in values.items() if (n == "f_c") == (law == "bingham")})
    assert np.array_equal(brief.predict(model, run), problem.predict(model, long)[:count])
    assert brief.predict(model, run, 0).shape == (count,)
