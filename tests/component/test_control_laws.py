"""The run-time laws: published tables, exact inverses, limits, and equality under numba."""

from __future__ import annotations

import ast
import sys
from math import cos, exp, pi, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import bristle.component
import bristle.physics.motion_file
import bristle.units
from bristle.component import control_laws
from bristle.core.jit import compiled
from bristle.physics.laws import law_code
from bristle.physics.laws.lugre import LuGre

P = [parameter.value for parameter in LuGre.parameters.values()]
BINGHAM_P = [1.3, 0.83, 100.0, 20.0, 0.02, 1.0]
BINGHAM, LUGRE = law_code("bingham"), law_code("lugre")
LIMITS = (control_laws.STILL, control_laws.LEAST_SLOPE, 8.0)

speeds = st.floats(control_laws.STILL, 0.5)
signs = st.sampled_from([-1.0, 1.0])

# Command, velocity, deflection, voltage, force: the reconstructed inverse law, to 10 digits.
INVERSE_TABLE = [
    (4.0, 0.1, 0.002, 3.121156809, 4.0),
    (6.0, 0.02, 0.002, 4.056934872, 6.0),
    (12.0, 0.02, 0.002, 8.0, 9.852973094),  # saturated
    (1.0, 0.1, 0.002, 0.0, 1.367379470),  # saturated
    (-5.0, -0.1, -0.002, 4.306727146, -5.0),
    (5.0, -0.1, -0.002, 0.0, -1.367379470),  # a damper cannot push
    (3.0, 0.0005, 0.001, 0.0, 0.700015496),  # too slow
    (3.0, 0.01, 0.0001, 4.561938681, 1.461742250),  # too small a slope
]


@pytest.mark.parametrize(("u", "v", "z", "voltage", "force"), INVERSE_TABLE)
def test_lugre_inverse_table(u: float, v: float, z: float, voltage: float, force: float) -> None:
    V = control_laws.voltage_of_law(LUGRE, P, u, v, [z], LIMITS)
    assert pytest.approx(voltage, abs=5e-9) == V
    assert control_laws.force_of_law(LUGRE, P, v, V, [z]) == pytest.approx(force, abs=5e-9)


@given(v=speeds, sign=signs, share=st.floats(-1.0, 1.0), V=st.floats(0.0, 8.0))
def test_lugre_inverse_gives_back_the_voltage(
    v: float, sign: float, share: float, V: float
) -> None:
    v, z = sign * v, share / 500.0
    slope = control_laws.force_of_law(LUGRE, P, v, 1.0, [z]) - control_laws.force_of_law(
        LUGRE, P, v, 0.0, [z]
    )
    found = control_laws.voltage_of_law(
        LUGRE, P, control_laws.force_of_law(LUGRE, P, v, V, [z]), v, [z], LIMITS
    )
    if abs(slope) >= control_laws.LEAST_SLOPE:
        assert found == pytest.approx(V, abs=1e-12 * 10.0 / control_laws.LEAST_SLOPE)
    else:
        assert 0.0 <= found <= V * (1.0 + 1e-12) + 1e-12


@given(v=speeds, sign=signs, V=st.floats(0.0, 8.0))
def test_bingham_inverse_gives_back_the_voltage(v: float, sign: float, V: float) -> None:
    force = control_laws.force_of_law(BINGHAM, BINGHAM_P, sign * v, V, [0.0])
    found = control_laws.voltage_of_law(BINGHAM, BINGHAM_P, force, sign * v, [0.0], LIMITS)
    assert found == pytest.approx(V, abs=1e-10)


@given(u=st.floats(0.0, 1e3), v=speeds, sign=signs)
def test_no_inverse_asks_a_damper_to_push(u: float, v: float, sign: float) -> None:
    z = sign / 500.0
    assert control_laws.voltage_of_law(LUGRE, P, -sign * u, sign * v, [z], LIMITS) == 0.0
    assert (
        control_laws.voltage_of_law(BINGHAM, BINGHAM_P, -sign * u, sign * v, [0.0], LIMITS) == 0.0
    )


def test_estimated_deflection_is_exact_and_bounded() -> None:
    z, v, h = [0.0], 0.3, 0.02  # a_0 v h = 3: explicit Euler would diverge
    for k in range(50):
        control_laws.estimate_states(LUGRE, P, v, 4.0, h, z)
        assert z[0] == pytest.approx((1.0 - exp(-500.0 * v * h * (k + 1))) / 500.0, rel=1e-12)
    z = [1e-3]
    control_laws.estimate_states(LUGRE, P, 0.0, 4.0, h, z)
    assert z == [1e-3]


@pytest.mark.parametrize(
    ("u", "f", "voltage"),
    [(5, 3, 8), (3, 5, 0), (-5, 3, 0), (-5, -3, 8), (-3, -5, 0), (0.4, 0.2, 0), (5, 0, 0)],
)
def test_truth_table_of_the_clipped_law(u: float, f: float, voltage: float) -> None:
    assert control_laws.clipped_voltage(u, f, 0.5, 8.0) == voltage


def test_clipped_law_does_not_answer_a_command_of_exactly_the_threshold() -> None:
    assert control_laws.clipped_voltage(0.5, 0.2, 0.5, 8.0) == 0.0
    assert control_laws.clipped_voltage(0.5, 0.2, 0.0, 8.0) == 8.0


@given(w=st.floats(-1e6, 1e6), v=st.floats(-1.0, 1.0), v_max=st.floats(0.1, 1e3))
def test_signed_voltage_stays_in_its_limits_and_maps_back(w: float, v: float, v_max: float) -> None:
    V = control_laws.signed_voltage(w, v, v_max)
    assert 0.0 <= V <= v_max
    same_side = w * (1.0 if v >= 0.0 else -1.0)
    if 0.0 <= same_side <= v_max:
        assert control_laws.applied_signed(V, v) == w
    else:
        assert V in (0.0, v_max)


def test_signed_voltage_takes_rest_as_forward() -> None:
    assert control_laws.signed_voltage(3.0, 0.0, 8.0) == 3.0
    assert control_laws.signed_voltage(-3.0, -0.0, 8.0) == 0.0
    assert control_laws.signed_voltage(-3.0, -0.1, 8.0) == 3.0


@pytest.mark.parametrize(
    ("v", "row"),
    [(0.0, 0), (2.4e-4, 0), (2.6e-4, 1), (-0.1, 200), (0.29999, 600), (0.3, 600), (-7.0, 600)],
)
def test_table_row_is_the_nearest_within_the_table(v: float, row: int) -> None:
    assert control_laws.table_row(v, 0.3, 601) == row


def test_linear_controller_is_its_matrices() -> None:
    rng = np.random.default_rng(1)
    n, rows, row = 4, 3, 2
    A, B, W, C = (rng.normal(size=shape) for shape in ((rows, n, n), *[(rows, n)] * 3))
    x = rng.normal(size=n)
    flat = [matrix.ravel().tolist() for matrix in (A, B, W, C)]
    state, spare = x.tolist(), [0.0] * n
    assert control_laws.command(n, flat[3], row, state) == pytest.approx(C[row] @ x)
    control_laws.advance(n, *flat[:3], row, state, (0.7, -0.3), spare)
    assert state == pytest.approx(A[row] @ x + 0.7 * B[row] - 0.3 * W[row])


def test_low_pass_is_exact_for_a_signal_linear_between_samples() -> None:
    corner, h = 2.0 * pi * 18.0, 0.01  # corner h = 1.13: no explicit scheme would do
    samples = [0.0, 1.0, -0.5, 0.25, 2.0, 2.0]
    filtered = 0.0
    for k in range(1, len(samples)):
        filtered = control_laws.low_passed(filtered, samples[k - 1], samples[k], corner, h)
        exact = 0.0
        for j in range(k):
            slope = (samples[j + 1] - samples[j]) / h

            def inside(t: float, j: int = j, slope: float = slope, end: float = k * h) -> float:
                return corner * exp(-corner * (end - t)) * (samples[j] + slope * (t - j * h))

            exact += quad(inside, j * h, (j + 1) * h, epsabs=1e-13)[0]
        assert filtered == pytest.approx(exact, abs=1e-12)


def test_velocity_of_filtered_displacement_has_the_filters_gain_and_lag() -> None:
    corner, omega, h = 2.0 * pi * 18.0, 2.0 * pi * 2.1, 0.002
    filtered, before = 0.0, 0.0
    for k in range(1, 2001):
        now = 0.01 * sin(omega * k * h)
        filtered = control_laws.low_passed(filtered, before, now, corner, h)
        before = now
    t = 2000 * h
    response = 1j * omega * corner / (1j * omega + corner)
    exact = 0.01 * (response.real * sin(omega * t) + response.imag * cos(omega * t))
    velocity = control_laws.filtered_velocity(filtered, before, corner)
    assert velocity == pytest.approx(exact, abs=1e-3 * 0.01 * omega)


def test_leaky_integral_of_a_constant_is_exact() -> None:
    corner, h, total = 0.5, 0.02, 0.0
    for _ in range(100):
        total = control_laws.leaky_integral(total, 3.0, 3.0, corner, h)
    assert total == pytest.approx(3.0 / corner * (1.0 - exp(-corner * 2.0)), rel=1e-12)


def test_skyhook_brakes_and_never_pushes() -> None:
    assert control_laws.skyhook_command(-0.2, 50.0) == -10.0
    assert control_laws.skyhook_switch(0.1, 0.2, 8.0) == 8.0
    assert control_laws.skyhook_switch(-0.1, -0.2, 8.0) == 8.0
    assert control_laws.skyhook_switch(0.1, -0.2, 8.0) == 0.0
    assert control_laws.skyhook_switch(0.1, 0.0, 8.0) == 0.0


voltage_of_law, force_of_law = control_laws.voltage_of_law, control_laws.force_of_law
estimate_states = control_laws.estimate_states
clipped, signed, applied = (
    control_laws.clipped_voltage,
    control_laws.signed_voltage,
    control_laws.applied_signed,
)
row_of, command, advance = control_laws.table_row, control_laws.command, control_laws.advance
low_passed, filtered_velocity = control_laws.low_passed, control_laws.filtered_velocity
leaky_integral, skyhook_command = control_laws.leaky_integral, control_laws.skyhook_command
skyhook_switch = control_laws.skyhook_switch


def every_law(u, v, z, p, bingham_p, A, B, W, C, x, spare, bent, out):  # type: ignore[no-untyped-def]
    """Call every law once; one function, so that numba compiles them together."""
    bent[0] = z
    out[0] = voltage_of_law(LUGRE, p, u, v, bent, (1e-3, 0.5, 8.0))
    out[1] = voltage_of_law(BINGHAM, bingham_p, u, v, bent, (1e-3, 0.5, 8.0))
    out[2] = force_of_law(LUGRE, p, v, out[0], bent)
    out[3] = force_of_law(BINGHAM, bingham_p, v, out[1], bent)
    estimate_states(LUGRE, p, v, out[0], 0.002, bent)
    out[4] = bent[0]
    out[5] = clipped(u, out[2], 0.5, 8.0)
    out[6] = signed(u, v, 8.0)
    out[7] = applied(out[6], v)
    row = row_of(v, 0.3, 3)
    out[8] = row
    out[9] = command(2, C, row, x)
    advance(2, A, B, W, row, x, (u, v), spare)
    out[10] = x[0]
    out[11] = x[1]
    out[12] = low_passed(z, v, u, 113.0, 0.002)
    out[13] = filtered_velocity(out[12], u, 113.0)
    out[14] = leaky_integral(z, v, u, 0.5, 0.002)
    out[15] = skyhook_command(v, 50.0)
    out[16] = skyhook_switch(u, v, 8.0)


def test_the_recent_level_is_a_size_that_fades() -> None:
    assert control_laws.recent_level(1.0, -3.0, 0.5) == 3.0
    assert control_laws.recent_level(4.0, -1.0, 0.5) == 2.0


def test_python_and_numba_agree() -> None:
    rng = np.random.default_rng(2)
    fast = compiled(every_law)
    tables = [rng.normal(size=size) for size in (12, 6, 6, 6)]
    for u, v, z in rng.normal(size=(200, 3)) * [6.0, 0.1, 0.001]:
        state = rng.normal(size=2)
        slow_out, fast_out = [0.0] * 17, np.zeros(17)
        lists = [table.tolist() for table in tables]
        every_law(
            float(u),
            float(v),
            float(z),
            P,
            BINGHAM_P,
            *lists,
            state.tolist(),
            [0.0] * 2,
            [0.0],
            slow_out,
        )
        arrays = (np.array(P), np.array(BINGHAM_P), *tables, state.copy(), np.zeros(2), np.zeros(1))
        fast(u, v, z, *arrays, fast_out)
        np.testing.assert_allclose(fast_out, slow_out, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    "path",
    [
        *sorted(Path(bristle.component.__file__).parent.glob("*.py")),
        *(Path(str(module.__file__)) for module in (bristle.units, bristle.physics.motion_file)),
    ],
    ids=lambda path: path.stem,
)
def test_bundled_code_is_python_3_9_and_standard_library(path: Path) -> None:
    tree = ast.parse(path.read_text(), feature_version=(3, 9))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".")[0] for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [(node.module or "").split(".")[0]]
        else:
            continue
        assert set(names) <= set(sys.stdlib_module_names)
