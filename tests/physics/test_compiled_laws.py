"""One source, two paths: plain Python and numba give the same numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bristle.component.structure import StructureModel
from bristle.jit import compiled
from bristle.physics import damper, structure
from bristle.physics.building import paper_building
from bristle.physics.effect import EFFECTS, effects_of
from bristle.physics.inputs import Inputs
from bristle.physics.laws import laws_of
from bristle.physics.signals import KINDS, PARAMETERS, rate, value

DAMPER_CASES = [
    (law, effects)
    for law in (law.name for law in laws_of("damper"))
    for effects in [
        [],
        *([e.name] for e in effects_of("damper", law)),
        *(
            [e.name for e in effects_of("damper", law) if e.name != other]
            for other in ("backlash", "mount_compliance")  # one series element at a time
        ),
    ]
]
STRUCTURE_CASES: list[list[str]] = [
    [],
    *([e.name] for e in effects_of("structure")),
    [e.name for e in effects_of("structure")],
]


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Keep machine code out of the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BRISTLE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def fast_damper(cache: Any) -> Any:
    return compiled(damper.step)


@pytest.fixture(scope="module")
def fast_structure(cache: Any) -> Any:
    return compiled(structure.step)


def test_every_effect_takes_part() -> None:
    tried = {name for _, effects in DAMPER_CASES for name in effects}
    tried |= {name for effects in STRUCTURE_CASES for name in effects}
    assert tried == {name for name, effect in EFFECTS.items() if effect.site != "sensor"}


def damper_run(
    step: Any, law: str, effects: list[str], exponent: float, to: Any, halts: bool
) -> np.ndarray:
    """Return force, friction and states of 150 steps; `to` makes the sequences."""
    model = damper.DamperModel(law, {"exponent": exponent}, effects)
    setup = damper.setup_of(law, {"exponent": exponent}, effects, to, to)
    z, work = to(model.z), to([0.0] * damper.work_size())
    found = []
    last = (0.0, 0.0, 0.0, 4.0)
    for k in range(1, 151):
        dt = (0.002, 0.01, 0.0005)[k % 3]
        t = 0.002 * k
        now = (
            float(0.012 * np.sin(15.0 * t)),
            float(0.18 * np.cos(15.0 * t)),
            float(-2.7 * np.sin(15.0 * t)),
            float(4.0 + 3.9 * np.sin(7.0 * t)),
        )
        z1 = to([0.0] * len(model.z))
        halt = 6.0 * now[1] if halts else 0.0
        begin, end = (Inputs(*at, dt, 0.0, halt, halts) for at in (last, now))
        pair = step(setup._replace(active=True), begin, end, z, z1, work)
        z, last = z1, now
        found.append([*pair, *z])
    return np.array(found)


@pytest.mark.parametrize(
    ("law", "effects"), DAMPER_CASES, ids=lambda v: v if isinstance(v, str) else "+".join(v)
)
def test_dampers(fast_damper: Any, law: str, effects: list[str]) -> None:
    for exponent, halts in ((0.0, False), (1.0, True), (2.0, False)):
        plain = damper_run(damper.step, law, effects, exponent, list, halts)
        fast = damper_run(fast_damper, law, effects, exponent, np.array, halts)
        scale = np.abs(plain).max(axis=0)
        assert (np.abs(fast - plain).max(axis=0) <= 1e-12 * np.maximum(scale, 1e-9)).all()
        assert np.abs(plain[:, 0]).max() > 1.0


VALUES = {
    "storey_softening.d_half": 0.003,
    "storey_softening.yields": 0.4,
    "storey_softening.d_y": 0.001,
}


def structure_run(step: Any, effects: list[str], to: Any) -> np.ndarray:
    model = StructureModel(paper_building(), VALUES, effects)
    m = model.m
    s = structure.step_matrices(m, 5e-4)
    stiffnesses, matrices = to(m.stiffnesses), [to(row) for row in (s.phi, s.held, s.ramp)]
    x, z, p, on = to(model.x), to(model.z or [0.0]), to(model.p), to(model.on)
    work = to([0.0] * structure.work_size(m.n))
    setup = structure.Setup(
        m.n, m.isolated, stiffnesses, *matrices, s.h, p, on, active=bool(effects)
    )
    found = []
    f0, f1 = to([1.0] + [0.0] * (m.n - 1)), to([1.5] + [0.0] * (m.n - 1))
    for k in range(400):
        x1, z1 = to([0.0] * len(model.x)), to([0.0] * max(1, len(model.z)))
        a0, a1 = (float(4.0 * np.sin(0.01 * i)) for i in (k, k + 1))
        step(setup, structure.Loads(a0, a1, f0, f1, 0.0), x, z, x1, z1, work)
        x, z = x1, z1
        found.append(list(x))
    return np.array(found)


@pytest.mark.parametrize("effects", STRUCTURE_CASES, ids="+".join)
def test_structures(fast_structure: Any, effects: list[str]) -> None:
    plain = structure_run(structure.step, effects, list)
    fast = structure_run(fast_structure, effects, np.array)
    scale = np.abs(plain).max(axis=0)
    assert (np.abs(fast - plain).max(axis=0) <= 1e-12 * scale).all()


@pytest.mark.parametrize("kind", KINDS)
def test_signals(kind: str) -> None:
    p = np.array([parameter.value for parameter in PARAMETERS.values()])
    times, samples = np.array([0.0, 0.4, 1.0]), np.array([1.0, -2.0, 0.5])
    for function in (value, rate):
        fast = compiled(function)
        for t in np.linspace(-0.5, 1.5, 41).tolist():
            plain = function(KINDS[kind], t, p.tolist(), times.tolist(), samples.tolist())
            assert fast(KINDS[kind], t, p, times, samples) == pytest.approx(plain, rel=1e-12)
