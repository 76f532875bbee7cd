"""Examples: their equations against closed forms and balances, their files, the sealed answer."""

from __future__ import annotations

import json
from dataclasses import replace
from math import copysign, exp, pi
from pathlib import Path

import numpy as np
import pytest

from bristle.cli import main
from bristle.errors import StudyError
from bristle.examples import make, rigs
from bristle.examples.hidden import FILE, HIDDEN, UNITS, Scales, able, choose, seal, unseal
from bristle.examples.make import Choice, make_bench, make_building
from bristle.examples.rigs import CENTRE, Damper, in_library_names
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS
from tests.test_imports import ROOT, imported

SCALES = Scales(10.0, 0.18, 0.02, 0.02, drift=5e-3)
TABLE = CENTRE["bingham"]
SHORT = 1.5  # s
STEADY = rigs.Programme(lambda _t: 3.0)
STEPPED = rigs.Programme(lambda t: 6.0 if 0.5 <= t + 1e-9 < 1.0 else 1.0, (0.5, 1.0))


def motion(seed: int = 1) -> rigs.Motion:
    rng = np.random.default_rng(seed)
    return rigs.bench_motion("multisine", SHORT, 0.02, 0.18, rng)


def secret(name: str) -> dict[str, float]:
    return HIDDEN[name].draw(np.random.default_rng(3), SCALES)


def steady_state(law: str, w: float, volts: float) -> float:
    p = CENTRE[law]
    yields = p["Y_0"] + p["Y_1"] * volts
    drag = p["D_0"] + p["D_1"] * volts
    return copysign(yields, w) + drag * w * exp(-abs(w) / p["w_n"])


def test_the_equations_use_no_law_no_effect_and_no_fit() -> None:
    for name in ("rigs", "devices", "hidden"):
        path = ROOT / "bristle" / "examples" / f"{name}.py"
        ours = {one for one in imported(path) if one.startswith("bristle.")}
        assert {one.split(".")[1] for one in ours} <= {"errors", "core", "examples"}


def test_what_is_not_outside_has_the_name_of_an_effect_of_the_library() -> None:
    for one in HIDDEN.values():
        assert (one.name in EFFECTS) is not one.outside


def test_a_bingham_damper_has_its_closed_form() -> None:
    run = rigs.perform(Damper("bingham", TABLE), motion(), STEPPED, SCALES)
    for k in (100, 300, 400, 650):
        expected = steady_state("bingham", run["velocity"][k], run["voltage"][k])
        assert run["force"][k] == pytest.approx(expected, rel=1e-12)
    assert abs(run["force"][0]) < 1e-6  # it begins at rest


def test_a_lugre_damper_slides_like_a_bingham_damper() -> None:
    t = rigs.times(1.0)
    slide = rigs.Motion(t, lambda q: (0.05 * q, 0.05, 0.0))
    run = rigs.perform(Damper("lugre", CENTRE["lugre"]), slide, STEADY, SCALES)
    assert run["force"][-1] == pytest.approx(steady_state("lugre", 0.05, 3.0), rel=1e-5)


def test_a_sine_of_the_yield_force_alone_has_the_area_four_f_x() -> None:
    t = rigs.times(1.0)
    wave = rigs.Motion(
        t, lambda q: (0.01 * np.sin(2 * pi * q), 0.02 * pi * np.cos(2 * pi * q), 0.0)
    )
    dry = Damper("bingham", TABLE | {"D_0": 0.0, "D_1": 0.0})
    run = rigs.perform(dry, wave, rigs.Programme(lambda _t: 0.0), SCALES)
    area = np.trapezoid(run["force"] * run["velocity"], t)
    assert area == pytest.approx(4 * TABLE["Y_0"] * 0.01, rel=1e-4)


@pytest.mark.parametrize("name", [one for one in HIDDEN if "bench" in HIDDEN[one].rigs])
@pytest.mark.parametrize("law", sorted(CENTRE))
def test_whatever_is_hidden_on_a_bench_changes_the_force_and_does_not_swamp_it(
    name: str, law: str
) -> None:
    hidden = Damper(law, CENTRE[law], secret(name))
    bare = Damper(law, CENTRE[law])
    runs = [rigs.perform(one, motion(), STEPPED, SCALES) for one in (hidden, bare)]
    assert np.all(np.isfinite(runs[0]["force"]))
    if name != "temperature":  # it needs longer than this run to warm up
        assert 0.05 < rigs.share(runs[:1], runs[1:]) < 0.9


def test_a_gas_spring_adds_its_own_force_and_nothing_else() -> None:
    values = secret("gas_spring")
    with_it = rigs.perform(Damper("bingham", TABLE, values), motion(), STEADY, SCALES)
    without = rigs.perform(Damper("bingham", TABLE), motion(), STEADY, SCALES)
    x, length, n = with_it["displacement"], values["gas_length"], values["gas_power"]
    gas = values["gas_k"] * length / n * ((1 - x / length) ** -n - 1)
    assert with_it["force"] - without["force"] == pytest.approx(gas, abs=1e-9)


def a_tower(**hidden: float) -> rigs.Tower:
    frame = rigs.frame(np.array(rigs.MASSES), np.array(rigs.STIFFNESSES))
    return rigs.Tower(frame, Damper("lugre", CENTRE["lugre"]), hidden, SCALES)


def shaken(rig: rigs.Tower) -> rigs.Signals:
    rng = np.random.default_rng(4)
    return rig.perform(8.0 * rigs.ground("quake", 3.0, rng), STEPPED)


def test_a_tower_is_in_equilibrium_with_its_damper() -> None:
    rig = a_tower()
    run = shaken(rig)
    f = rig.frame
    inertia = sum(
        m * (run[f"{level}_acceleration_absolute"] + f.alpha * run[f"{level}_velocity"])
        for m, level in zip(f.masses, rigs.LEVELS, strict=True)
    )
    layer = f.stiffnesses[0] * (run["base_displacement"] + f.beta * run["base_velocity"])
    assert np.max(np.abs(run["force"])) > 1.0
    assert inertia + layer + run["force"] == pytest.approx(0.0, abs=1e-9)


def test_the_response_moves_as_its_accelerations_say() -> None:
    run = shaken(a_tower())
    seen = np.gradient(run["floor2_velocity"], run["time"]) + run["ground_acceleration"]
    felt = run["floor2_acceleration_absolute"]
    assert np.sqrt(np.mean((seen - felt) ** 2)) < 0.02 * np.sqrt(np.mean(felt**2))


@pytest.mark.parametrize("name", [one for one in HIDDEN if HIDDEN[one].rigs == ("building",)])
def test_what_is_hidden_in_a_building_moves_it_otherwise(name: str) -> None:
    plain, other = shaken(a_tower()), shaken(a_tower(**secret(name)))
    change = plain["base_displacement"] - other["base_displacement"]
    assert np.sqrt(np.mean(change**2)) > 0.02 * np.sqrt(np.mean(plain["base_displacement"] ** 2))


def test_half_the_tolerance_changes_the_response_by_far_less_than_its_noise() -> None:
    rig, rng = a_tower(), np.random.default_rng(4)
    acceleration = 8.0 * rigs.ground("quake", 3.0, rng)
    rough, fine = (rig.perform(acceleration, STEPPED, rtol) for rtol in (1e-6, 1e-8))
    for name in ("force", "base_acceleration_absolute"):
        change = np.sqrt(np.mean((rough[name] - fine[name]) ** 2))
        assert change < 1e-3 * np.sqrt(np.mean(fine[name] ** 2))


@pytest.mark.parametrize("name", list(HIDDEN))
def test_every_hidden_value_has_a_unit(name: str) -> None:
    assert set(secret(name)) <= set(UNITS)


@pytest.mark.parametrize("law", sorted(CENTRE))
def test_the_revealed_values_are_those_of_the_library_for_the_same_force(law: str) -> None:
    told = in_library_names(law, CENTRE[law])
    model = LAWS[law]
    assert set(told) == {name for name in model.parameters if name != "exponent"}
    defaults = {name: model.parameters[name].value for name in told}
    assert told == pytest.approx(defaults)  # an example's table is that of the library's damper


def test_a_seed_draws_one_that_the_rig_can_have() -> None:
    drawn = {
        choose("bench", "lugre", (), False, np.random.default_rng(seed))[0].name
        for seed in range(80)
    }
    assert drawn == set(able("bench", "lugre"))
    outside = choose("building", "lugre", (), True, np.random.default_rng(0))[0]
    assert outside.outside


def test_a_building_is_refused_a_damper_that_would_need_an_effect_to_hold(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="presliding"):
        make_building(tmp_path / "tower", Choice(law="bingham", nothing=True))
    assert not (tmp_path / "tower").exists()


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        (Choice(effects=("gas_sprng",)), 'Did you mean "gas_spring"'),
        (Choice(effects=("duffing",)), "hide in a bench"),
        (Choice(effects=("ripple", "ripple")), "twice"),
        (Choice(effects=("ripple",), nothing=True), "exclude each other"),
        (Choice(nothing=True, outside=True), "exclude each other"),
        (Choice(noise=0.5), "0 to 0.2"),
        (Choice(noise=float("nan")), "0 to 0.2"),
        (Choice(seed=-1), "positive"),
        (Choice(law="linear_storey"), "bingham, lugre"),
    ],
)
def test_what_cannot_be_is_refused(choice: Choice, words: str, tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=words):
        make_bench(tmp_path / "rig", choice)
    assert not (tmp_path / "rig").exists()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("example") / "my_rig"
    assert main(["example", "bench", str(folder)]) == 0
    return folder


def test_an_example_is_a_study_with_units_and_roles(rig: Path) -> None:
    header = (rig / "data" / "train_1.csv").read_text().splitlines()[0]
    assert header == "time [s],displacement [mm],velocity [mm/s],voltage [V],force [N]"
    settings = make.Study(rig).settings
    roles = [run.role for run in settings.runs]
    assert (roles.count("train"), roles.count("holdout")) == (3, 2)
    assert settings.channels["displacement"].unit == "mm"
    assert "1 % noise" in (rig / "README.md").read_text()


def test_its_answer_is_sealed_and_can_be_opened(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = unseal(rig)
    (name,) = answer["hidden"]
    assert name in EFFECTS
    for file in (p for p in rig.rglob("*") if p.is_file()):
        assert name not in file.read_text(encoding="utf-8", errors="ignore")
    capsys.readouterr()
    assert main(["example", "reveal", str(rig)]) == 0
    said = capsys.readouterr().out
    assert f"Hidden: {name}." in said
    assert "no verdict yet" in said


def test_the_same_seed_gives_the_same_files(rig: Path, tmp_path: Path) -> None:
    make_bench(tmp_path / "again", Choice())
    for file in sorted((rig / "data").iterdir()):
        assert (tmp_path / "again" / "data" / file.name).read_bytes() == file.read_bytes()


def test_an_example_writes_over_nothing(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["example", "bench", str(rig)]) == 2
    assert "there already" in capsys.readouterr().err


def test_a_broken_seal_is_told(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="there is no"):
        unseal(tmp_path)
    seal(tmp_path, {"hidden": []})
    assert unseal(tmp_path) == {"hidden": []}
    text = (tmp_path / FILE).read_text()
    (tmp_path / FILE).write_text(text.replace("eyJ", "!!!"))
    with pytest.raises(StudyError, match="was changed"):
        unseal(tmp_path)


def test_the_list_names_all_that_can_be_hidden(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["example", "list", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == list(HIDDEN)
    assert main(["example", "list"]) == 0
    said = capsys.readouterr().out
    assert all(one.about in said for one in HIDDEN.values())


def test_noise_is_of_the_size_that_was_asked_for(tmp_path: Path) -> None:
    quiet, loud = (replace(Choice(nothing=True), noise=noise) for noise in (0.0, 0.03))
    runs = [
        make_bench(tmp_path / f"{choice.noise}", choice).runs().train for choice in (quiet, loud)
    ]
    clean, noisy = (np.concatenate([run["force"] for run in one]) for one in runs)
    assert np.std(noisy - clean) == pytest.approx(0.03 * np.sqrt(np.mean(clean**2)), rel=0.1)


@pytest.mark.slow  # the README's diagnosis; a contract study has one by default
def test_the_example_of_the_first_page_is_found(rig: Path) -> None:
    assert main(["study", "auto", str(rig)]) == 0
    study = make.Study(rig)
    assert sorted(study.model().effects) == unseal(rig)["hidden"]
    assert (study.verdict() or {})["kind"] == "none"
