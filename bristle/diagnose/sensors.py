"""Sensor faults, told from missing physics through what the channels say of each other.

Displacement and velocity are redundant: one is the integral of the other. So gain, sign, delay and
offset of either show without any model of the damper. A clipped channel repeats its extreme. A
force of the wrong sign yields energy. What no redundancy shows (the gain of force or voltage, the
zero of displacement) changes no force that the model predicts: refitting absorbs it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ..records.derived import LATE, derived_velocity
from ..records.measurement import Measurement

Array = NDArray[np.float64]

WINDOW = 2.0
"""Length of the pieces [s] over which velocity is integrated: longer ones drift with its noise."""

LOW_PASS = 20.0
"""Corner [Hz] of the filter on both: derivatives of the velocity's noise would drown the rest."""

SURE = 6.0
"""How many standard deviations a fault must be away from none."""

SMALLEST = {"gain": 0.01, "bias": 0.01, "delay": 0.2}
"""Smallest fault that matters: of the channel, of the channel's RMS, of the sampling step."""

LONGEST = 5
"""Samples in a row at the very same extreme that no noisy signal shows."""


@dataclass(frozen=True)
class SensorFault:
    """A fault of one channel.

    `fault` is "gain" [1], "sign" (-1), "delay" [s], "bias" or "clipping" [the channel's unit], or
    what an instrument does: "lag" [s, of first order], "high-pass" [1/s, its corner]; "derived" [s,
    how late] is a velocity that was computed from the displacement. `std` is the uncertainty of
    `value`; `words` a sentence.
    """

    channel: str
    fault: str
    value: float
    std: float
    words: str

    def as_dict(self) -> dict[str, object]:
        """Return what verdict.json holds of it."""
        return {
            "channel": self.channel, "fault": self.fault, "value": self.value, "std": self.std,
            "words": self.words,
        }  # fmt: skip


def sensor_faults(runs: Sequence[Measurement]) -> list[SensorFault]:
    """Return the faults that the channels show of each other, over all runs."""
    found = clipped(runs)
    cut = {fault.channel for fault in found}
    pairs = [run for run in runs if run.has("displacement", "velocity")]
    computed = {run.name: how for run in pairs if (how := derived_velocity(run))}
    found += _computed(pairs, computed)
    pairs = [run for run in pairs if run.name not in computed]
    if pairs and not cut & {"displacement", "velocity"}:
        found += kinematic(pairs)
    return found + signs(runs, found)


def _computed(runs: Sequence[Measurement], how: Mapping[str, str]) -> list[SensorFault]:
    """Return a velocity that was computed from the displacement, where that made it late."""
    late = [run for run in runs if LATE[how.get(run.name, "central")]]
    if not late:
        return []
    first = late[0]
    value = LATE[how[first.name]] * first.step
    return [
        SensorFault(
            "velocity", "derived", value, 0.0,
            f"Velocity is the {how[first.name]} difference of displacement, half a sample "
            f"({1e3 * abs(value):.3g} ms) {'late' if value > 0.0 else 'early'}: it was computed, "
            "not measured, and is left out.",
        )
    ]  # fmt: skip


def kinematic(runs: Sequence[Measurement]) -> list[SensorFault]:
    """Return what is wrong between displacement and velocity.

    In pieces of `WINDOW`, by least squares on signals low-passed alike,

        x = int v/gain + D v + E v' + F v'' + G int int v - bias t/gain + constant;

    a late velocity has E = D^2/2, F = D^3/6; one that lags by first order E = F = 0; a geophone,
    which loses what is slow, has G. The spread over pieces gives the uncertainty.
    """
    theta, std = _pooled(runs)
    gain = 1.0 / theta[0]
    found = []
    if gain < 0.0:
        found.append(
            SensorFault(
                "velocity", "sign", -1.0, 0.0,
                "Displacement and velocity have opposite signs: one of the two is turned.",
            )
        )  # fmt: skip
        theta = -theta
        gain = -gain
    if abs(theta[4]) > max(SURE * std[4], 0.02):
        found.append(
            SensorFault(
                "velocity", "high-pass", theta[4] * gain, std[4] * gain,
                "Velocity lacks what is slow in the rate of displacement, as from a geophone with "
                f"a corner near {theta[4] * gain / (2.0 * np.pi):.2g} Hz.",
            )
        )  # fmt: skip
        return found
    theta, std = _pooled(runs, slow=False)
    theta, gain = theta * np.sign(theta[0]), 1.0 / abs(theta[0])
    spread = std[0] * gain * gain
    if abs(gain - 1.0) > max(SURE * spread, SMALLEST["gain"]):
        found.append(
            SensorFault(
                "velocity", "gain", gain, spread,
                f"Velocity is {gain:.3f} times the rate of displacement: one of the two gains is "
                "off, and motion alone cannot tell which.",
            )
        )  # fmt: skip
    found += _late(theta * gain, std * gain, runs[0].step)
    bias, bias_std = -theta[5] * gain, std[5] * gain
    rms = float(np.sqrt(np.mean(np.concatenate([run["velocity"] for run in runs]) ** 2)))
    if abs(bias) > max(SURE * bias_std, SMALLEST["bias"] * rms):
        found.append(
            SensorFault(
                "velocity", "bias", bias, bias_std,
                f"Velocity shows {bias:.3g} m/s too much: its integral runs away from "
                "displacement.",
            )
        )  # fmt: skip
    return found


def _late(theta: Array, std: Array, step: float) -> list[SensorFault]:
    """Return a delay of one channel, or a lag of the velocity's instrument."""
    late, late_std = float(theta[1]), float(std[1])
    if abs(late) <= max(SURE * late_std, SMALLEST["delay"] * step):
        return []
    if late > 0.0:
        shift = abs(theta[2] - 0.5 * late**2) / std[2] + abs(theta[3] - late**3 / 6.0) / std[3]
        lag = abs(theta[2]) / std[2] + abs(theta[3]) / std[3]
        if lag < shift:
            return [
                SensorFault(
                    "velocity", "lag", late, late_std,
                    f"Velocity lags the rate of displacement by {1e3 * late:.2f} ms and rounds it, "
                    "as an instrument of first order does.",
                )
            ]  # fmt: skip
    channel = "velocity" if late > 0.0 else "displacement"
    return [
        SensorFault(
            channel, "delay", abs(late), late_std,
            f"{channel.capitalize()} comes {1e3 * abs(late):.2f} ms late against the other.",
        )
    ]  # fmt: skip


def _pooled(runs: Sequence[Measurement], slow: bool = True) -> tuple[Array, Array]:
    """Return the coefficients (6,) of `kinematic`, G zero unless `slow`, and their deviations."""
    pieces = [piece for run in runs for piece in _pieces(run)]
    use = [0, 1, 2, 3, 4, 5] if slow else [0, 1, 2, 3, 5]
    normal = sum(A[:, use].T @ A[:, use] for A, _ in pieces)
    right = sum(A[:, use].T @ b for A, b in pieces)
    inverse = np.linalg.pinv(normal, hermitian=True)
    theta = inverse @ right
    scores = np.array([A[:, use].T @ (b - A[:, use] @ theta) for A, b in pieces])
    std = np.sqrt(np.maximum(np.diag(inverse @ scores.T @ scores @ inverse), 1e-300))
    full, full_std = np.zeros(6), np.full(6, np.inf)
    full[use], full_std[use] = theta, std
    return full, full_std


def _pieces(run: Measurement) -> list[tuple[Array, Array]]:
    """Return the columns (n, 6) and the displacement (n,) of each piece, means removed."""
    dt = run.step
    corner = min(LOW_PASS, 0.2 / dt)
    filtered = butter(4, 2.0 * dt * corner, output="sos")
    x, v = (sosfiltfilt(filtered, run[name]) for name in ("displacement", "velocity"))
    a = np.gradient(v, dt)
    whole = np.column_stack([_integral(v, dt), v, a, np.gradient(a, dt)])
    size = max(40, round(WINDOW / dt))
    out = []
    for begin in range(0, len(x) - size // 2, size):
        part = slice(begin, begin + size)
        first = whole[part, 0] - whole[part, 0].mean()
        t = dt * np.arange(len(first))
        A = np.column_stack([first, whole[part, 1:], _integral(first, dt), t])
        out.append((A - A.mean(axis=0), x[part] - x[part].mean()))
    return out


def _integral(values: Array, dt: float) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * dt * (values[1:] + values[:-1]))])


def clipped(runs: Sequence[Measurement]) -> list[SensorFault]:
    """Return the channels that repeat an extreme: their range ends before the motion does."""
    found = []
    for channel in ("force", "displacement", "velocity", "voltage", "current"):
        limits = [
            limit
            for run in runs
            if run.has(channel)
            and (limit := _limit(run[channel], run.noise.get(channel, 0.0))) is not None
        ]
        if limits:
            level = max(limits)
            found.append(
                SensorFault(
                    channel, "clipping", level, 0.0,
                    f"{channel.capitalize()} repeats the very same extreme in {len(limits)} "
                    f"run{'s' * (len(limits) > 1)}: its range ended at {level:.4g} (SI).",
                )
            )  # fmt: skip
    return found


def _limit(values: Array, noise: float) -> float | None:
    """Return the level at which a signal is cut off, None where it is not.

    At a cut the very same number comes many times in a row; a noisy signal never does that.
    """
    top = float(np.max(np.abs(values)))
    if not 1e-4 * top < noise < 0.2 * top:
        return None  # without noise the extreme of a signal may well repeat
    at_end = np.isclose(np.abs(values), top, rtol=0.0, atol=1e-9 * top)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], at_end.astype(int), [0]])))
    longest = int((edges[1::2] - edges[::2]).max())
    return top if longest >= LONGEST and at_end.sum() >= 2 * LONGEST else None


def signs(runs: Sequence[Measurement], known: Sequence[SensorFault]) -> list[SensorFault]:
    """Return force or motion that is turned: a damper that yields energy; a voltage below zero."""
    found = []
    turned = any(fault.fault == "sign" for fault in known)
    able = [run for run in runs if run.has("force", "velocity")]
    if able and not turned:
        power = np.concatenate([run["force"] * run["velocity"] for run in able])
        if power.mean() < -0.2 * np.mean(np.abs(power)):
            found.append(
                SensorFault(
                    "force", "sign", -1.0, 0.0,
                    "Force times velocity is negative on average: a damper would feed energy in. "
                    "The force, or the motion, is turned.",
                )
            )  # fmt: skip
    drives = [run["voltage"] for run in runs if run.has("voltage")]
    if drives:
        V = np.concatenate(drives)
        low, high = np.quantile(V, [0.02, 0.98])
        if low < 0.0 and -low > 3.0 * max(high, 0.0):
            found.append(
                SensorFault(
                    "voltage", "sign", -1.0, 0.0,
                    "The voltage is negative nearly always: its sign is turned.",
                )
            )  # fmt: skip
    return found


def mended(runs: Sequence[Measurement], faults: Sequence[SensorFault]) -> list[Measurement]:
    """Return the measurements as they would be without the faults, so that physics can be judged.

    Displacement is the reference of velocity. Clipped samples count as not measured.
    """
    return [_mended(run, faults) for run in runs]


def _mended(run: Measurement, faults: Sequence[SensorFault]) -> Measurement:
    channels, measured = dict(run.channels), run.measured
    noise = dict(run.noise)
    for fault in faults:
        if fault.channel not in channels:
            continue
        values = channels[fault.channel]
        if fault.fault == "sign":
            channels[fault.channel] = -values
        elif fault.fault == "gain":
            channels[fault.channel] = values / fault.value
            noise[fault.channel] = noise.get(fault.channel, 0.0) / abs(fault.value)
        elif fault.fault == "bias":
            channels[fault.channel] = values - fault.value
        elif fault.fault == "delay":
            channels[fault.channel] = earlier(values, fault.value / run.step)
        elif fault.fault in ("lag", "high-pass", "derived"):
            del channels[fault.channel]  # displacement says the same, without it
        elif fault.fault == "clipping":
            measured = measured & (np.abs(values) < fault.value * (1.0 - 1e-9))
    return replace(run, channels=channels, measured=measured, noise=noise)


def earlier(values: Array, samples: float) -> Array:
    """Return a signal moved ahead in time by a number of samples, its last value held."""
    from scipy.interpolate import make_interp_spline

    index = np.arange(len(values), dtype=float)
    at = np.minimum(index + samples, len(values) - 1.0)
    return np.asarray(make_interp_spline(index, values, k=1)(np.maximum(at, 0.0)))
