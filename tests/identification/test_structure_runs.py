"""A building's response as problems: equilibrium holds, its noise is as stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken import building, friction, measured, shake

from bristle.comparison.predictions import coordinates_of_run
from bristle.data.extra_channels import Extra
from bristle.diagnosis.site import shortened
from bristle.errors import RecordError
from bristle.identification.building_motion import jumps, responses, shear
from bristle.identification.building_sites import (
    StructureProblem,
    damper_run,
    damping_below,
    layer_run,
    problems_of,
    sliding,
    storey_run,
    structure_problems,
    thinned,
)
from bristle.identification.equilibrium import reconstructed
from bristle.identification.rig import Site
from bristle.identification.rig_fit import RigFit, at_bound, fit_line
from bristle.model.model import Model
from bristle.physics.laws.linear_layer import LinearLayer


@pytest.fixture(scope="module")
def truth():
    """Return a building, the clean channels of a run and its response, with the force."""
    b = building(2, True, 1)
    clean = shake(b, 11, friction, samples=8000)
    return b, clean, responses([measured(clean, 11)], b)[0]


def test_smoothed_motion_errs_as_much_as_it_says(truth):
    b, clean, response = truth
    for i, level in enumerate(b.levels()):
        for j, (what, found) in enumerate((("displacement", response.x), ("velocity", response.v))):
            error = found[i] - clean[f"{level}_{what}"]
            # White jerk leaves room for jumps; a motion without them is known better than that.
            assert 0.5 * response.std[i, j] < np.std(error) < 1.2 * response.std[i, j]
            # The redundancy of three instruments: several times better than the one alone.
            assert np.std(error) < 0.7 * 0.01 * np.std(clean[f"{level}_{what}"])
            assert np.std(response.draws[i, :, :, j]) == pytest.approx(response.std[i, j], rel=0.2)


def test_an_extra_channel_is_a_coordinate_at_every_site(truth):
    b, _, response = truth
    tilt = np.sin(3.0 * response.dt * np.arange(response.x.shape[1]))
    known = replace(response, extra={"tilt": Extra(tilt, "rad")})
    for found in (damper_run(known, b, "bingham"), layer_run(known, b), storey_run(known, b, 1)):
        assert found.whole.extra["tilt"].values is tilt
        np.testing.assert_array_equal(coordinates_of_run(found)["tilt"], tilt[found.keep])
        thin = thinned(StructureProblem([found])).runs[0]
        np.testing.assert_array_equal(thin.extra["tilt"].values, tilt[thin.keep])


@pytest.mark.parametrize("law", ["bingham", "lugre"])
def test_a_part_of_a_run_is_predicted_as_in_the_whole(truth, law):
    b, _, response = truth
    run = damper_run(response, b, law)
    problem, model, part = StructureProblem([run]), Model(law), slice(40, 6000, 3)
    whole = problem.predict(model, run)
    np.testing.assert_array_equal(problem.predict(model, run.of(part)), whole[part])


def test_a_jump_of_the_acceleration_is_no_noise():
    smooth = np.sin(np.arange(400) * 0.01)
    assert not np.any(jumps(smooth + np.random.default_rng(0).normal(size=400), 0.002))
    stepped = 1e-3 * np.random.default_rng(1).normal(size=400) + (np.arange(400) >= 200)
    assert np.flatnonzero(jumps(stepped, 0.002)).tolist() == [200]


def test_accelerations_of_floors_without_accelerometers_err_as_much_as_they_say(truth):
    b, clean, _ = truth
    floors = ("floor1_acceleration_absolute", "floor2_acceleration_absolute")
    response = responses([measured(clean, 11, without=floors)], b)[0]
    for i, channel in enumerate(floors, start=1):
        error = np.std((response.a[i] - clean[channel])[50:-50])
        # Friction kicks the floors, which a smooth motion does not hold whole.
        assert 0.8 * response.noise_a[i] < error < 1.5 * response.noise_a[i]
        drawn = np.std(response.draws[i, :, 50:-50, 2])
        assert drawn == pytest.approx(response.std[i, 2], rel=0.05)


def test_both_equilibria_give_the_force_and_their_noise(truth):
    b, clean, response = truth
    carried = clean["force"] + b.stiffnesses[0] * clean["base_displacement"]
    own, own_noise, *_ = reconstructed(response, b)
    own = own + b.stiffnesses[0] * response.x[0]
    for found, noise in (shear(response, b, 0)[:2], (own, own_noise)):
        assert np.std((found - carried)[25:]) == pytest.approx(noise, rel=0.1)
        assert abs(np.mean((found - carried)[25:])) < 0.05 * noise
    force, noise, white, error = reconstructed(response, b)
    assert np.std((force - clean["force"])[25:]) == pytest.approx(noise, rel=0.1)
    assert noise <= shear(response, b, 0)[1] * 1.05
    assert np.hypot(white, np.std(error)) == pytest.approx(noise, rel=0.1)


def test_shear_of_a_storey_is_its_spring(truth):
    b, clean, response = truth
    spring = b.stiffnesses[1] * (clean["floor1_displacement"] - clean["base_displacement"])
    found, noise, _ = shear(response, b, 1)
    assert np.std((found - spring)[25:]) == pytest.approx(noise, rel=0.1)


def test_lines_fitted_to_layer_and_storeys_are_the_springs(truth):
    b, _, response = truth
    runs = {"layer": layer_run(response, b), "storey1": storey_run(response, b, 1)}
    problems = structure_problems([measured(shake(b, 12, friction), 12)], [], b)
    assert set(problems) == {"layer", "storey1", "storey2", "damper"}
    for i, site in enumerate(("layer", "storey1", "storey2")):
        line = fit_line(problems[site][0], "linear_layer" if i == 0 else "linear_storey")
        assert abs(line.model.values["k"] - b.stiffnesses[i]) < 4.0 * line.std["k"]
        assert abs(line.model.values["c"]) < 4.0 * line.std["c"]
    assert runs["layer"].noise > runs["storey1"].noise  # all masses and the load cell


def test_where_the_base_may_be_held_is_left_out(truth):
    b, _, response = truth
    moves = sliding(response)
    assert 0.5 < moves.mean() < 1.0
    assert np.min(np.abs(response.v[0][moves])) > 3.0 * response.std[0, 1]
    run = layer_run(response, b)
    assert len(run.force) == np.sum(moves[25:])
    assert len(run.whole.force) == len(moves)
    assert len(damper_run(response, b, "lugre").force) == len(moves)
    assert len(damper_run(response, b, "bingham").force) == len(run.force)
    shared = damper_run(replace(response, force=None), b, "lugre")
    assert len(shared.force) == len(run.force), "the layer may hold it, and no load cell tells"


def test_a_run_in_which_the_base_is_held_throughout_is_left_out(truth):
    b, _, response = truth
    held = np.ones((b.size, 1))
    held[0] = 1e-9
    still = replace(response, name="still", v=response.v * held)
    problem, held_out = problems_of([still, response], [response], b, "bingham")["damper"]
    assert [run.name for run in problem.runs] == [run.name for run in held_out.runs] == ["run"]
    only_still = problems_of([still], [response], b, "lugre")
    assert len(only_still["damper"][0].runs) == 1
    assert "layer" not in only_still
    with pytest.raises(RecordError, match=r"still: the base does not move .* stronger ground"):
        problems_of([still], [response], b, "bingham")


def test_a_run_that_moves_late_is_left_out_of_the_search(truth):
    b, _, response = truth
    v = response.v.copy()
    v[0, :4000] = 0.0
    late = replace(response, name="late", v=v)
    problem, _ = problems_of([response, late], [response], b, "bingham")["damper"]
    first = 1500 * response.dt
    assert [run.name for run in shortened(problem, first).runs] == ["run"]
    assert shortened(problem.of([problem.runs[1]]), first).runs[0].name == "late"


def test_effects_of_the_structure_are_predicted_from_their_source(truth):
    b, _, _ = truth
    problems = structure_problems([measured(shake(b, 12, friction), 12)], [], b)
    problem, _ = problems["layer"]
    run = problem.runs[0]
    values = {"k": 900.0, "c": 0.0, "added_mass": 0.0, "offset": 0.1}
    plain = problem.predict(Model(LinearLayer.name, (), values), run)
    assert plain == pytest.approx(900.0 * run.x + 0.1)
    own = {"end_stop.clearance": 0.003, "end_stop.k": 2e3, "end_stop.c": 0.0}
    stopped = problem.predict(Model(LinearLayer.name, ("end_stop",), {**values, **own}), run)
    beyond = np.maximum(np.abs(run.x) - 0.003, 0.0)
    assert stopped - plain == pytest.approx(2e3 * beyond * np.sign(run.x), abs=1e-9)
    own = {"base_friction.limit": 0.7, "base_friction.x_s": 0.0}
    rubbed = problem.predict(Model(LinearLayer.name, ("base_friction",), {**values, **own}), run)
    assert rubbed - plain == pytest.approx(0.7 * np.sign(run.v), abs=1e-9)
    storey, _ = problems["storey2"]
    run = storey.runs[0]
    line = {"k": 1000.0, "c": 0.0, "offset": 0.0}
    own = {"storey_softening.d_half": 0.002, "storey_softening.shape": 2.0}
    soft = storey.predict(Model("linear_storey", ("storey_softening",), {**line, **own}), run)
    assert soft == pytest.approx(1000.0 * run.x / (1.0 + (run.x / 0.002) ** 2), abs=1e-9)


def test_an_effect_with_memory_sees_the_samples_that_are_left_out(truth):
    b, _, _ = truth
    problem, _ = structure_problems([measured(shake(b, 12, friction), 12)], [], b)["layer"]
    run = problem.runs[0]
    values = {"k": 0.0, "base_friction.limit": 1.0, "base_friction.x_s": 2e-3}
    found = problem.predict(Model(LinearLayer.name, ("base_friction",), values), run)
    share, expected = 0.0, [0.0]
    for v in 0.5 * (run.whole.v[1:] + run.whole.v[:-1]):
        side = np.sign(v)
        share = side + (share - side) * np.exp(-abs(v) * run.dt / 2e-3)
        expected.append(share)
    assert found == pytest.approx(np.array(expected)[run.keep], abs=1e-9)
    few = thinned(problem)
    again = few.predict(Model(LinearLayer.name, ("base_friction",), values), few.runs[0])
    assert again == pytest.approx(found[::5])


def test_without_a_force_the_layer_is_the_dampers_and_said_so(truth):
    b, clean, _ = truth
    clean = {**clean, "voltage": np.full_like(clean["time"], 2.0)}
    run = measured(clean, 3, without=("force",))
    problems = structure_problems([run], [run], b)
    assert set(problems) == {"storey1", "storey2", "damper"}
    assert problems["damper"][0].reconstructed
    with pytest.raises(RecordError, match="force was not measured"):
        layer_run(responses([run], b)[0], b)


def test_without_a_damper_the_layer_stands_alone():
    b = building(1, True, 2)
    run = measured(shake(b, 2, samples=3000), 2)
    assert set(structure_problems([run], [], b)) == {"storey1", "layer"}
    b = building(2, False, 2)
    run = measured(shake(b, 2, samples=3000), 2)
    assert set(structure_problems([run], [], b)) == {"storey1", "storey2"}


CHANNELS = [
    f"{level}_{what}"
    for level in ("base", "floor1", "floor2")
    for what in ("displacement", "velocity", "acceleration_absolute")
]


@pytest.mark.parametrize("gone", CHANNELS)
def test_motion_is_as_sure_as_it_says_without_any_one_channel(truth, gone):
    b, clean, _ = truth
    response = responses([measured(clean, 11, without=(gone,))], b)[0]
    for i, level in enumerate(b.levels()):
        for j, (what, found) in enumerate((("displacement", response.x), ("velocity", response.v))):
            error = (found[i] - clean[f"{level}_{what}"])[25:]
            # White jerk knows nothing of the jumps that friction gives the base's acceleration.
            most = 2.5 if i == 0 else 1.5
            assert np.std(error) < most * np.std(response.draws[i, :, 25:, j])
            # Where a channel is missing its own is found from the others to some per cent.
            assert np.std(error) < 0.05 * np.std(clean[f"{level}_{what}"])
    assert np.all(np.isfinite(response.draws))


def test_a_displacement_alone_gives_a_motion(truth):
    b, clean, _ = truth
    without = ("floor1_velocity", "floor1_acceleration_absolute")
    response = responses([measured(clean, 11, without=without)], b)[0]
    assert np.std(response.x[1] - clean["floor1_displacement"]) < 0.01 * np.std(response.x[1])
    assert np.std(response.v[1] - clean["floor1_velocity"]) < 0.05 * np.std(response.v[1])
    assert not response.accelerometer[1]


def test_what_is_slow_in_an_integrated_velocity_is_taken_from_the_level_beside(truth):
    b, clean, _ = truth
    shifted = dict(clean)
    for level in b.levels():  # an isolation layer that comes to rest elsewhere takes all along
        shifted[f"{level}_displacement"] = clean[f"{level}_displacement"] + 2e-3
    response = responses([measured(shifted, 11, without=("floor2_displacement",))], b)[0]
    assert np.mean(response.x[2]) == pytest.approx(
        np.mean(shifted["floor2_displacement"]), rel=0.01
    )


def test_runs_of_one_rig_may_have_other_instruments(truth):
    b, clean, _ = truth
    both = [measured(clean, 1), measured(clean, 2, without=("floor2_acceleration_absolute",))]
    first, second = responses(both, b)
    assert first.accelerometer.tolist() == [True, True, True]
    assert second.accelerometer.tolist() == [True, True, False]
    assert np.std(first.draws[2, :, :, 1]) < np.std(second.draws[2, :, :, 1])


def test_a_line_damps_and_says_where_the_data_push_it_below(truth):
    b, clean, _ = truth
    problem, _ = structure_problems([measured(clean, 11)], [], b)["storey1"]
    assert problem.damped == pytest.approx(damping_below(b, 1))
    assert 0.0 < problem.damped < 10.0
    run = problem.runs[0]
    fed = replace(run, force=run.force - 3.0 * problem.damped * run.v)
    found = fit_line(problem.of([fed]), "linear_storey")
    assert found.model.value("c") == -problem.damped
    assert at_bound(found.model)
    assert "c" not in found.std
    assert found.covariance.shape == (2, 2)
    assert found.model.value("k") == pytest.approx(b.stiffnesses[1], rel=0.05)
    site = Site("storey1", lambda _role: problem, is_line=True)
    (text,) = RigFit({"storey1": found}, {"storey1": site}).notes().values()
    assert "ask for a negative damping" in text
    plain = fit_line(problem, "linear_storey")
    assert plain.covariance == pytest.approx(plain.covariance.T)
    assert np.sqrt(np.diag(plain.covariance)) == pytest.approx(list(plain.std.values()))
    (text,) = RigFit({"storey1": plain}, {"storey1": site}).notes().values()
    shown = float(text.split("c = ")[1].split()[0])
    assert shown == pytest.approx(problem.damped + plain.model.value("c"), rel=1e-3)
    assert f"{problem.damped:.4g} of the file" in text
