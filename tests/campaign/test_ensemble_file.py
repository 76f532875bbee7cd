"""Ensemble files: what may vary, and one clear message for everything else."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest

from bristle import trust
from bristle.campaign import read_ensemble, stock_ensembles
from bristle.campaign.ensemble_file import Distribution, resolve_ensemble, share
from bristle.errors import EnsembleError, TrustError
from bristle.system.scenario import resolve_scenario

OWN_LAW = '''
from bristle.physics.law import Law, Parameter


class Mine(Law):
    """A viscous force."""

    name = "mine"
    parts = ("viscous",)
    source = "a test"
    parameters = {"c": Parameter(20.0, "N.s/m", (0.0, 1e5), "damping")}

    @staticmethod
    def viscous(q, z, p):
        return p.c * q.v
'''
Write = Callable[..., Path]
SHARES = [share(3, run, "a") for run in range(4000)]


def test_shares_are_even_and_differ_by_seed_run_and_name() -> None:
    counts, _ = np.histogram(SHARES, 20, (0.0, 1.0))
    # chi-square with 19 degrees of freedom: 43.8 is exceeded by chance once in a thousand times
    assert ((counts - 200.0) ** 2 / 200.0).sum() < 43.8
    assert abs(np.corrcoef(SHARES[:-1], SHARES[1:])[0, 1]) < 3.3 / 4000**0.5
    assert len({share(3, 0, "a"), share(4, 0, "a"), share(3, 1, "a"), share(3, 0, "b")}) == 4


def test_a_share_never_changes() -> None:
    """Run i of an ensemble is the same for ever: SHA-256 of "seed/run/name"."""
    assert share(1, 0, "damper.sigma_a") == pytest.approx(0.27484550782703515, rel=1e-15)


def test_distributions_have_the_moments_that_they_are_named_for() -> None:
    uniform = [Distribution("uniform", (2.0, 5.0)).draw(u) for u in SHARES]
    assert (min(uniform), max(uniform)) == pytest.approx((2.0, 5.0), abs=0.01)
    assert np.mean(uniform) == pytest.approx(3.5, abs=0.05)
    normal = [Distribution("normal", (10.0, 2.0)).draw(u) for u in SHARES]
    assert (np.mean(normal), np.std(normal)) == pytest.approx((10.0, 2.0), rel=0.03)
    log_uniform = [Distribution("log_uniform", (0.01, 100.0)).draw(u) for u in SHARES]
    assert np.median(log_uniform) == pytest.approx(1.0, rel=0.2)
    integers = [Distribution("integers", (1, 3)).draw(u) for u in SHARES]
    assert {kind: integers.count(kind) // 100 for kind in set(integers)} == pytest.approx(
        {1: 13, 2: 13, 3: 13}, abs=2
    )
    choice = [Distribution("choice", ("a", "b"), weights=(3.0, 1.0)).draw(u) for u in SHARES]
    assert choice.count("a") == pytest.approx(3000, abs=100)


def test_a_cut_normal_is_the_normal_between_its_ends() -> None:
    cut = Distribution("normal", (0.0, 1.0), within=(0.5, 4.0))
    values = [cut.draw(u) for u in SHARES]
    assert min(values) >= 0.5
    assert max(values) <= 4.0
    n = NormalDist()
    expected = (n.pdf(0.5) - n.pdf(4.0)) / (n.cdf(4.0) - n.cdf(0.5))
    assert np.mean(values) == pytest.approx(expected, rel=0.03)
    assert cut.draw(1e-12) == pytest.approx(0.5)


def test_each_takes_every_combination_equally_often(write: Write) -> None:
    second = '"voltage.level" = { each = [0.0, 4.0] }\n"ground.duration" = { each = [0.1, 0.2] }'
    plan = read_ensemble(write(('"voltage.level" = { each = [0.0, 4.0] }', second)))
    pairs = [
        tuple(plan.values(i)[n] for n in ("voltage.level", "ground.duration")) for i in range(8)
    ]
    assert plan.combinations == 4
    assert sorted(pairs[:4]) == [(0.0, 0.1), (0.0, 0.2), (4.0, 0.1), (4.0, 0.2)]
    assert pairs[:4] == pairs[4:]


def test_another_name_that_varies_leaves_the_others_alone(write: Write) -> None:
    plan = read_ensemble(write())
    more = read_ensemble(
        write(("[outputs]", '"damper.sigma_0" = { uniform = [400.0, 430.0] }\n[outputs]'))
    )
    for run in range(4):
        values = more.values(run)
        del values["damper.sigma_0"]
        assert values == plan.values(run)


def test_the_digest_follows_what_decides_numbers(write: Write, tmp_path: Path) -> None:
    digest = read_ensemble(write()).digest()
    assert read_ensemble(write(("runs = 12", "runs = 99"))).digest() == digest
    for old, new in (
        ("seed = 7", "seed = 8"),
        ("0.5", "0.6"),
        ("65.0", "66.0"),
        ('"rms"', '"last"'),
    ):
        assert read_ensemble(write((old, new))).digest() != digest, new
    record = tmp_path / "shake.csv"
    for peak in (1.0, 2.0):
        record.write_text(f"time [s],acceleration [m/s2]\n0.0,0.0\n0.1,{peak}\n0.2,0.0\n")
        path = write(
            ("half_sine_pulse", "el_centro_0p6g_constant_voltage"),
            ("[vary]", '[vary]\n"ground.record" = { choice = ["shake.csv"] }'),
        )
        assert read_ensemble(path).digest() != digest
        digest = read_ensemble(path).digest()


def test_the_stock_ensembles_are_right() -> None:
    assert "el_centro_damper_and_building" in [path.stem for path in stock_ensembles()]
    for path in stock_ensembles():
        assert read_ensemble(path.stem) == read_ensemble(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed = 7", "seed = -1", "seed = -1"),
        ("seed = 7", 'engine = "fmu"\nfmus = "wasm"', "python, native"),
        ("seed = 7", 'fmus = "native"', 'needs engine = "fmu"'),
        ("seed = 7", "vary = 3", "written twice"),
        ("half_sine_pulse", "half_sine_plus", 'mean "half_sine_pulse"'),
        ('"run.stop" = 0.5', '"run.stop" = "x"', "run.stop"),
        ("[vary]", '"components.damper.parameters.sigma_a" = 600.0\n[vary]', "in [set] as well"),
        ("damper.sigma_a", "damper.sigma_x", 'no parameter "sigma_x"'),
        ("damper.sigma_a", "dampr.sigma_a", 'no component "dampr"'),
        ("damper.sigma_a", "damper.force", "cannot be set"),
        ("normal = [650.0, 65.0]", "normal = [650.0]", "two finite numbers"),
        ("normal = [650.0, 65.0]", "normal = [650.0, 0.0]", "standard deviation 0"),
        ("normal = [650.0, 65.0]", "normal = [650.0, nan]", "two finite numbers"),
        ("within = [500.0, 800.0]", "within = [800.0, 500.0]", "must rise"),
        ("within = [500.0, 800.0]", "within = [5000.0, 8000.0]", "never comes"),
        ("within = [500.0, 800.0]", "within = [-500.0, 800.0]", "lies below 0"),
        ("{ uniform = [1.1, 1.4] }", "{ uniform = [1.4, 1.1] }", "must rise"),
        ("{ uniform = [1.1, 1.4] }", "{ uniform = [-1.4, 1.1] }", "must be positive"),
        ("{ uniform = [1.1, 1.4] }", "{ uniform = [1.1, 1.4], within = [1, 2] }", "with normal"),
        ("{ uniform = [1.1, 1.4] }", "{ log_uniform = [0.0, 1.4] }", "above 0"),
        ("{ uniform = [1.1, 1.4] }", "{ integers = [1.1, 2] }", "whole numbers"),
        ("{ uniform = [1.1, 1.4] }", "{ choice = [] }", "at least one"),
        ("{ uniform = [1.1, 1.4] }", "{ choice = [1.0, 2.0], weights = [1] }", "as many weights"),
        ("{ uniform = [1.1, 1.4] }", "3.0", "expected a table"),
        ("{ uniform = [1.1, 1.4] }", "{ uniform = [1.1, 1.4], normal = [1, 2] }", "needs one of"),
        ("building.masses.2", "building.masses.7", "there is 0 to 2"),
        ("building.masses.2", "building.mass", "'mass' is not there"),
        ("building.masses.2", "building.masses", "not a single number"),
        ("seed = 7", 'engine = "fmu"', "compiled"),
        ("voltage.level", "damper.voltage", "fed by voltage.voltage"),
        ("voltage.level", "components.damper.parameters.sigma_a", "one of them must go"),
        ("voltage.level", "damper.gas_spring.k", "nothing while damper.gas_spring.on is false"),
        ("{ each = [0.0, 4.0] }", "{ each = [0.0, 4000000.0] }", "lies above"),
        ("{ each = [0.0, 4.0] }", '{ each = [0.0, "four"] }', "a number"),
        ("floor2_acceleration_absolute", "floor9_acceleration", "no output"),
    ],
)  # fmt: skip
def test_mistakes_are_named(write: Write, old: str, new: str, message: str) -> None:
    path = write((old, new))
    with pytest.raises(Exception, match=message.replace("[", r"\[")) as caught:
        read_ensemble(path)
    assert caught.value.exit_code == 2  # type: ignore[attr-defined]


def test_a_parameter_of_an_effect_varies_where_that_is_switched_on(write: Write) -> None:
    k = ('"voltage.level" = { each', '"damper.gas_spring.k" = { each')
    read_ensemble(write(k, ("[vary]", '"damper.gas_spring.on" = true\n[vary]')))
    read_ensemble(write(k, ("[vary]", '[vary]\n"damper.gas_spring.on" = { each = [true, false] }')))


def test_a_whole_number_is_not_drawn_from_between_two(write: Write, tmp_path: Path) -> None:
    shutil.copy(resolve_scenario("el_centro_0p6g_lpv_sensors"), tmp_path / "own.toml")
    own = ("half_sine_pulse", "own.toml")
    seed = ('"voltage.level" = { each = [0.0, 4.0] }', '"sensors.seed" = { uniform = [1, 9] }')
    with pytest.raises(EnsembleError, match=r"is 1\.0; a whole number is right"):
        read_ensemble(write(own, seed))


def test_what_varies_is_tried_beside_what_is_set(write: Write) -> None:
    step = ("voltage.level", "run.step"), ("{ each = [0.0, 4.0] }", "{ each = [0.0003, 0.0001] }")
    assert read_ensemble(write(*step, ("0.5", "0.3"))).system.overrides == {"run.stop": 0.3}
    with pytest.raises(EnsembleError, match="a whole number is right"):
        read_ensemble(write(*step))


def test_a_law_beside_the_ensemble_is_found_and_consent_is_asked(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(trust.VARIABLE)
    text = resolve_scenario("half_sine_pulse").read_text()
    (tmp_path / "own.toml").write_text(text.replace('fmu = "LuGreDamper"', 'law = "lugre"'))
    (tmp_path / "own_law.py").write_text(OWN_LAW)
    own = ("half_sine_pulse", "own.toml")
    path = write(own, ("[vary]", '[vary]\n"damper.law" = { each = ["own_law.py"] }'))
    with pytest.raises(TrustError) as caught:
        read_ensemble(path)
    assert Path(caught.value.path) == tmp_path / "own_law.py"


def test_a_folder_of_results_does_not_hide_a_stock_ensemble(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "el_centro_damper_and_building").mkdir()
    monkeypatch.chdir(tmp_path)
    assert resolve_ensemble("el_centro_damper_and_building") == stock_ensembles()[0].absolute()


def test_all_mistakes_are_named_at_once(write: Write) -> None:
    path = write(("runs = 12", "runs = -1"), ("65.0]", "-65.0]"), ('"rms"', '"rsm"'))
    with pytest.raises(EnsembleError) as caught:
        read_ensemble(path)
    assert [line.split(":")[1] for line in str(caught.value).splitlines()] == ["4", "11", "16"]


def test_a_file_beside_the_ensemble_is_found(write: Write, tmp_path: Path) -> None:
    shutil.copy(resolve_scenario("half_sine_pulse"), tmp_path / "own.toml")
    plan = read_ensemble(write(("half_sine_pulse", "own.toml")))
    assert plan.system.origin == tmp_path / "own.toml"


@pytest.mark.parametrize("name", ["nothing.toml", "el_centro_damper", ""])
def test_a_missing_file_is_named(name: str) -> None:
    with pytest.raises(EnsembleError, match=r"el_centro_damper_and_building|is a folder"):
        read_ensemble(name)
