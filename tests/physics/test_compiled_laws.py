"""One source, two paths: plain Python and numba give the same numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bristle.component.structure import StructureModel
from bristle.core.jit import compiled
from bristle.identification.histories import Tracks, compiled_history, force_history
from bristle.physics import damper, structure
from bristle.physics.building import paper_building
from bristle.physics.effect import EFFECTS, effects_of
from bristle.physics.laws import laws_of
from bristle.physics.signals import KINDS, PARAMETERS, rate, value
from bristle.physics.tuples import Inputs

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


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Keep machine code out of the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BRISTLE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def fast_structure(cache: Any) -> Any:
    return compiled(structure.step)


def test_every_effect_takes_part() -> None:
    tried = {name for _, effects in DAMPER_CASES for name in effects}
    tried |= {name for effects in STRUCTURE_CASES for name in effects}
    assert tried == {name for name, effect in EFFECTS.items() if effect.site != "sensor"}


def damper_run(
    history: Any, law: str, effects: list[str], exponent: float, dt: float, to: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Return the force at 150 samples and the states at the end; `to` makes the sequences."""
    model = damper.DamperModel(law, {"exponent": exponent}, effects)
    setup = damper.setup_of(law, {"exponent": exponent}, effects, to, to)
    t = dt * np.arange(150)
    voltage = 4.0 + 3.9 * np.sin(7.0 * t)
    voltage[60:] -= 2.0  # a jump has a step of its own
    motion = (0.012 * np.sin(15.0 * t), 0.18 * np.cos(15.0 * t), -2.7 * np.sin(15.0 * t), voltage)
    given = Inputs(*(to(channel.tolist()) for channel in motion), dt, 0.0, 0.0, False)
    none = Tracks(np.zeros(0, dtype=np.int64), np.zeros((0, len(t))))
    z, z1, out = to(model.z), to([0.0] * len(model.z)), to([0.0] * len(t))
    work = to([0.0] * damper.room(len(z)))
    history(setup._replace(active=True), given, none, z, z1, work, out)
    return np.array(out), np.array(z)


@pytest.mark.parametrize(
    ("law", "effects"), DAMPER_CASES, ids=lambda v: v if isinstance(v, str) else "+".join(v)
)
def test_dampers(law: str, effects: list[str]) -> None:
    for exponent, dt in ((0.0, 0.002), (1.0, 0.01), (2.0, 0.0005)):
        plain = damper_run(force_history, law, effects, exponent, dt, list)
        fast = damper_run(compiled_history(damper.LIBRARY), law, effects, exponent, dt, np.array)
        assert np.abs(plain[0]).max() > 1.0
        for one, other in zip(plain, fast, strict=True):
            scale = np.maximum(np.abs(one), 1e-3 * np.abs(one).max())
            assert (np.abs(other - one) <= 1e-12 * np.maximum(scale, 1e-9)).all()


def held_run(step: Any, law: str, effects: list[str], to: Any) -> np.ndarray:
    """Return force, friction and states of 150 steps whose rod friction may hold."""
    model = damper.DamperModel(law, {"exponent": 1.0}, effects)
    setup = damper.setup_of(law, {"exponent": 1.0}, effects, to, to)._replace(active=True)
    z, work, found = to(model.z), to([0.0] * damper.room(len(model.z))), []
    last = (0.0, 0.0, 0.0, 4.0)
    for k in range(1, 151):
        dt, t = (0.002, 0.01, 0.0005)[k % 3], 0.002 * k
        v = float(0.18 * np.cos(15.0 * t))
        now = (
            float(0.012 * np.sin(15.0 * t)), v, float(-2.7 * np.sin(15.0 * t)),
            float(4.0 + 3.9 * np.sin(7.0 * t)),
        )  # fmt: skip
        z1 = to([0.0] * len(model.z))
        begin, end = (Inputs(*at, dt, 0.0, 6.0 * v, True) for at in (last, now))
        pair = step(setup, begin, end, z, z1, work)
        z, last = z1, now
        found.append([*pair, *z])
    return np.array(found)


@pytest.fixture(scope="module")
def fast_step(cache: Any) -> Any:
    return compiled(damper.step)


@pytest.mark.slow  # every law with every friction is compiled
@pytest.mark.parametrize(
    ("law", "effects"), DAMPER_CASES, ids=lambda v: v if isinstance(v, str) else "+".join(v)
)
def test_friction_that_may_hold(fast_step: Any, law: str, effects: list[str]) -> None:
    plain = held_run(damper.step, law, effects, list)
    fast = held_run(fast_step, law, effects, np.array)
    scale = np.abs(plain).max(axis=0)
    assert (np.abs(fast - plain).max(axis=0) <= 1e-12 * np.maximum(scale, 1e-9)).all()


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


@pytest.mark.usefixtures("cache")
@pytest.mark.parametrize("kind", KINDS)
def test_signals(kind: str) -> None:
    p = np.array([parameter.value for parameter in PARAMETERS.values()])
    times, samples = np.array([0.0, 0.4, 1.0]), np.array([1.0, -2.0, 0.5])
    for function in (value, rate):
        fast = compiled(function)
        for t in np.linspace(-0.5, 1.5, 41).tolist():
            plain = function(KINDS[kind], t, p.tolist(), times.tolist(), samples.tolist())
            assert fast(KINDS[kind], t, p, times, samples) == pytest.approx(plain, rel=1e-12)
