"""Learned effects run natively with the same numbers, alone and in the export of a study."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from both_forms import Both, Native, folder, needs_zig

import bristle
from bristle.cli import main
from bristle.fmu.build import plan
from bristle.identification.histories import DamperForces
from bristle.learning.closed_forms import closed_forms, formula_of
from bristle.learning.closure_file import Closure, Input, Region, Store, closure_text, rounded
from bristle.learning.curve import AT_DAMPER, PARTS, Curve, CurvePlace, may_change, parts_at
from bristle.learning.effect_file import effect_text
from bristle.learning.signals import ALONG, RING, SLIP
from bristle.native.build import build
from bristle.native.entrance import component_of
from bristle.native.zig import here
from bristle.prediction.export import export_study
from bristle.study.study import Study
from tests.learning.test_curve import curve_of, slip_of
from tests.learning.test_line_curves import LAYER, STOREY
from tests.learning.test_line_curves import curve_of as line_curve_of

pytestmark = [needs_zig, pytest.mark.slow]  # dampers with learned curves are compiled

EQUAL = 1e-12
STEP = 0.002  # s


def covering(place: CurvePlace) -> list[tuple[str, str]]:
    """Return pairs of a part of the model and a signal, each part and each signal among them."""
    pairs = [
        (part, along)
        for part in parts_at(place)
        for along in ALONG
        if may_change(part, along, place)
    ]
    chosen: list[tuple[str, str]] = []
    for part, along in pairs:
        seen = [{pair[side] for pair in chosen} for side in (0, 1)]
        if part not in seen[0] or along not in seen[1]:
            chosen.append((part, along))
    assert {part for part, _ in chosen} >= {*parts_at(place)} - {SLIP, RING}
    return chosen


def written(curves: list[Curve], where: Path) -> list[Path]:
    """Write an effect for each curve; return their files."""
    files = []
    for k, curve in enumerate(curves, 1):
        file = where / f"learned_{k}.py"
        file.write_text(effect_text(file.stem, curve, "made for a test, 2026"), encoding="utf-8")
        files.append(file)
    return files


def test_every_part_and_every_signal_gives_the_same_numbers(tmp_path: Path) -> None:
    curves = [curve_of(part, along) for part, along in covering(AT_DAMPER)] + [slip_of()]
    assert {curve.part for curve in curves} == {*PARTS} - {RING}  # that acts on what is shown
    assert {curve.along for curve in curves} >= {*ALONG}
    files = written(curves, tmp_path)
    formula = tmp_path / "learned_formula.py"
    bent = curve_of("fluid", "displacement")
    best, *_ = closed_forms(bent, [0.01] * 5)
    text = effect_text(formula.stem, bent, "made for a test, 2026", formula_of(best, bent))
    formula.write_text(text, encoding="utf-8")
    files.append(formula)
    what = plan("LuGreDamper", name="Learned", effects=files)
    form = Native(build(what, folder() / "learned", [here()]))
    plain = Both(form, component_of(what))
    plain.begin()
    plain.largest_difference()
    alone = plain.shown()[1]
    for file in files:
        pair = Both(form, component_of(what), **{f"{file.stem}.on": True})
        pair.begin()
        assert pair.largest_difference() <= EQUAL, file.stem
        mine, other = pair.said()
        assert mine == other
        assert pair.shown()[1] != alone, file.stem
        pair.end()


def network() -> Closure:
    """Return a closure with a weight for every kind of input."""
    inputs = (
        Input("v", 0.0), Input("x", 0.0), Input("recent_v", 0.03), Input("way", 0.002, 0.01),
        Input("V", 0.0), Input("recent_V", 0.05),
        Input("label", 0.0, 1.0, "oil", 80.0, 100.0, 95.0),
    )  # fmt: skip
    size = len(inputs)
    draw = np.random.default_rng(1)
    middle, spread = np.zeros(size), np.array([0.1, 0.01, 0.1, 0.5, 3.0, 3.0, 90.0])
    end = np.full(size - 1, 2.0)
    region = Region(-end, end, 0.5 * end, np.eye(size - 1), 4.0)
    line = np.array([-2.0, -0.1, 0.2, 2.0]), np.array([-1.7, -0.5, 0.6, 1.7])
    hidden, bias, out, linear = (
        rounded(draw.standard_normal(shape)) for shape in ((8, size), 8, 8, size)
    )
    store = Store(0.001, 0.02, 0.008, 1e-3)
    return Closure(
        inputs, middle, spread, region, (line,) * size, hidden, bias, out, linear, 0.1, 5.0, store,
        "voltage",
    )  # fmt: skip


def test_a_closure_gives_the_same_numbers(tmp_path: Path) -> None:
    file = tmp_path / "closure_1.py"
    file.write_text(closure_text(file.stem, network(), "made for a test, 2026"), encoding="utf-8")
    what = plan("LuGreDamper", name="Closed", effects=[file])
    form = Native(build(what, folder() / "closed", [here()]))
    plain = Both(form, component_of(what))
    plain.begin()
    plain.largest_difference()
    pair = Both(form, component_of(what), **{"closure_1.on": True})
    pair.begin()
    assert pair.largest_difference() <= EQUAL
    assert pair.shown()[1] != plain.shown()[1]
    pair.end()


def test_curves_of_a_layer_and_of_a_storey_give_the_same_numbers(tmp_path: Path) -> None:
    curves = [
        line_curve_of(part, along, place)
        for place in (LAYER, STOREY)
        for part, along in covering(place)
    ]
    files = written(curves, tmp_path)
    what = plan("Structure", name="LearnedHouse", effects=files)
    form = Native(build(what, folder() / "learned", [here()]))
    for file in files:
        pair = Both(form, component_of(what), **{f"{file.stem}.on": True})
        pair.begin()
        assert pair.largest_difference() <= EQUAL, file.stem
        pair.end()


# -- a study


def measured(path: Path, phase: float) -> None:
    """Write a run of a LuGre damper on a bench."""
    t = STEP * np.arange(600)
    x = 0.008 * np.sin(12.0 * t + phase) + 0.002 * np.sin(33.0 * t)
    v = 0.096 * np.cos(12.0 * t + phase) + 0.066 * np.cos(33.0 * t)
    V = 3.0 + 2.0 * np.sin(3.0 * t + phase)
    force = DamperForces("lugre", []).force(x, v, np.gradient(v, STEP), V, STEP, {})
    header = "time [s],displacement [m],velocity [m/s],voltage [V],force [N]"
    table = np.column_stack([t, x, v, V, force])
    np.savetxt(path, table, delimiter=",", header=header, comments="")


def test_a_study_with_a_learned_effect_is_exported_in_both_forms(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, phase in (("train_1", 0.3), ("holdout_1", 1.1)):
        measured(tmp_path / f"{name}.csv", phase)
    study = Study.create(tmp_path / "rig", sorted(tmp_path.glob("*.csv")))
    written([curve_of("fluid", "displacement")], study.effects_folder)
    study = Study(study.folder)
    assert study.usable_effects() == []
    study.add_step("choose", "a test", study.model().with_effect("learned_1"))
    plain = export_study(study, tmp_path / "python")
    order = ["export", "rig", "--native", "--platform", here().name, "--out", "native"]
    assert main(order) == 0
    frames = [bristle.run(plain.scenario), bristle.run(tmp_path / "native" / plain.scenario.name)]
    assert list(frames[0].columns) == list(frames[1].columns)
    for name in frames[0].columns:
        peak = float(frames[0][name].abs().max()) or 1.0
        assert float((frames[0][name] - frames[1][name]).abs().max()) <= EQUAL * peak, name
    # It needs neither the study's file nor Python: a fresh process has the effect in the FMU.
    (study.effects_folder / "learned_1.py").unlink()
    fmu = tmp_path / "native" / plain.fmu.name
    code = (
        "import fmpy; d = fmpy.read_model_description(r'{}'); print(d.coSimulation and "
        "any(v.name == 'learned_1.on' and v.start == 'true' for v in d.modelVariables))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code.format(fmu)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "True"
