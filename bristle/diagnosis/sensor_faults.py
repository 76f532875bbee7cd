"""Sensor faults, told from missing physics through what the channels say of each other.

Displacement and velocity are redundant: one is the integral of the other. So gain, sign, delay and
offset of either show without any model of the damper. A clipped channel repeats its extreme. A
force of the wrong sign yields energy. What no redundancy shows (the gain of force or voltage, the
zero of displacement) changes no force that the model predicts: refitting absorbs it.

`data.relation` looks at columns before anything is known of them; here the velocity is integrated
over pieces, so that an instrument's lag, corner and bias show, and how sure they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ..core.arrays import Array
from ..core.finding import Finding
from ..core.text import joined, plain, quantity
from ..data.channels import channel_unit
from ..data.cut_off import CHANNELS, LATE, derived_velocity, ends_of, outermost
from ..data.measurement import Measurement
from ..physics.effect import instrument_of
from .rule import SENSOR

# Sensor faults as they are told.

UNITS = {
    "gain": "1", "sign": "1", "unrelated": "1", "delay": "s", "lag": "s", "derived": "s",
    "high-pass": "rad/s",
}  # fmt: skip
"""Units of faults that do not have their channel's."""


# A sensor's fault is a finding. Its `kind` is "gain" [1], "sign" (-1), "delay" [s], "bias" or
# "clipping" [the channel's unit], or what an instrument does: "lag" [s, of first order],
# "high-pass" [1/s, its corner]; "derived" [s, how late] is a velocity that was computed from the
# displacement, "unrelated" (0) one of another motion. "clock" [s/s] is what the channel's clock
# gains on that of the motion; "range" [the channel's unit] and "slew" [that per second] limit a
# command between its record and the coil. No model corrects "clipping", so that its `run` is "" and
# `runs` are those that it was seen in.


def _fault(
    kind: str, channel: str, value: float, std: float, text: str, either: str = ""
) -> Finding:
    return Finding(kind, "warning", text, channel=channel, value=value, std=std, either=either)


def as_json(fault: Finding) -> dict[str, object]:
    """Return what verdict.json holds of a fault."""
    whole = {
        "channel": fault.channel, "fault": fault.kind, "value": fault.value, "std": fault.std,
        "words": fault.text, "either": fault.either, "run": fault.run, "runs": [*fault.runs],
    }  # fmt: skip
    return {key: one for key, one in whole.items() if one or not isinstance(one, (str, list))}


def instruments_of(sensors: Sequence[Finding]) -> tuple[str, ...]:
    """Return the sensor effects that the faults of channels are.

    What one run alone has is no effect of a model, which all runs share: it is corrected there.
    """
    found = (instrument_of(one.channel, one.kind) for one in sensors if not one.run)
    return tuple(dict.fromkeys(name for name in found if name))


def size_text(channel: str, fault: str, value: float) -> str:
    """Return the value of a fault with its unit.

    Parameters
    ----------
    channel, fault, value : of the fault
    """
    if fault == "clock":
        return f"{plain(1e6 * value)} ppm"
    own = channel_unit(channel)
    unit = UNITS.get(fault, f"{own}/s" if fault == "slew" else own)
    return quantity(value, unit, fine=True)


# Channels whose range ends before the motion does.

NAMED = 3
"""Runs that a sentence names; of more it says how many there are."""


def clipped(runs: Sequence[Measurement]) -> list[Finding]:
    """Return the channels that repeat an extreme: their range ends before the motion does."""
    found = []
    for channel in CHANNELS:
        there = [run for run in runs if run.has(channel)]
        both = {run.name: ends_of(run, channel) for run in there}
        ends = {name: cut for name, cut in both.items() if cut}
        if ends:
            every = [end for cut in ends.values() for end in cut]
            at = joined([quantity(end, channel_unit(channel), 4) for end in outermost(every)])
            named = joined([*ends]) if len(ends) <= NAMED else f"{len(ends)} runs"
            text = f"{channel.capitalize()} repeats the very same extreme in {named}: its range "
            fault = _fault("clipping", channel, max(map(abs, every)), 0.0, f"{text}ended at {at}.")
            found.append(replace(fault, runs=tuple(ends) if len(ends) < len(runs) else ()))
    return found


WINDOW = 2.0
"""Length of the pieces [s] over which velocity is integrated: longer ones drift with its noise."""

LOW_PASS = 20.0
"""Corner [Hz] of the filter on both: derivatives of the velocity's noise would drown the rest."""

FEWEST = 3
"""Pieces from which on their spread means anything."""


def sensor_faults(runs: Sequence[Measurement]) -> list[Finding]:
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


def _computed(runs: Sequence[Measurement], how: Mapping[str, str]) -> list[Finding]:
    """Return a velocity that was computed from the displacement, where that made it late."""
    late = [run for run in runs if LATE[how.get(run.name, "central")]]
    if not late:
        return []
    first = late[0]
    value = LATE[how[first.name]] * first.step
    text = (
        f"Velocity is the {how[first.name]} difference of displacement, half a sample "
        f"({plain(1e3 * abs(value))} ms) {'late' if value > 0.0 else 'early'}: it was computed, "
        "not measured, and is left out."
    )
    return [_fault("derived", "velocity", value, 0.0, text)]


def kinematic(runs: Sequence[Measurement]) -> list[Finding]:
    """Return what is wrong between displacement and velocity.

    In pieces of `WINDOW`, by least squares on signals low-passed alike,

        x = int v/gain + D v + E v' + F v'' + G int int v - bias t/gain + constant;

    a late velocity has E = D^2/2, F = D^3/6; one that lags by first order E = F = 0, by second
    order F = 0; a geophone, which loses what is slow, has G. The spread over pieces gives the
    uncertainty.
    """
    if sum(len(_begins(run)) for run in runs) < FEWEST:
        return []  # the spread over pieces is what says how sure a fault is
    if _unrelated_share(runs) > SENSOR.unrelated:
        text = (
            "Velocity is not the rate of displacement, whatever gain and delay it is given: one of "
            "the two belongs to another motion, or is not connected."
        )
        return [_fault("unrelated", "velocity", 0.0, 0.0, text, "displacement")]
    theta, std = _pooled(runs)
    gain = 1.0 / theta[0]
    found = []
    if gain < 0.0:
        found.append(_turned(runs))
        theta = -theta
        gain = -gain
    if abs(theta[4]) > max(SENSOR.fault_sigma * std[4], SENSOR.least_corner):
        corner = theta[4] * gain
        text = (
            "Velocity lacks the low frequencies of the rate of displacement, like a geophone with "
            f"a corner near {plain(corner / (2.0 * np.pi), 2)} Hz."
        )
        return [*found, _fault("high-pass", "velocity", corner, std[4] * gain, text)]
    theta, std = _pooled(runs, slow=False)
    theta, gain = theta * np.sign(theta[0]), 1.0 / abs(theta[0])
    spread = std[0] * gain * gain
    if abs(gain - 1.0) > max(SENSOR.fault_sigma * spread, SENSOR.least_gain):
        text = (
            f"Velocity is {gain:.3f} times the rate of displacement: one of the two gains is off, "
            "and neither motion nor force shows which one. If velocity is right, displacement "
            f"shows {1.0 / gain:.3f} of what it should."
        )
        found.append(_fault("gain", "velocity", gain, spread, text, "displacement"))
    found += _late(theta * gain, std * gain, _mean_step(runs))
    bias, bias_std = -theta[5] * gain, std[5] * gain
    rms = float(np.sqrt(np.mean(np.concatenate([run["velocity"] for run in runs]) ** 2)))
    if abs(bias) > max(SENSOR.fault_sigma * bias_std, SENSOR.least_bias * rms):
        text = f"Velocity shows {plain(bias)} m/s too much: its integral drifts away from "
        found.append(_fault("bias", "velocity", bias, bias_std, f"{text}displacement."))
    return found


def _turned(runs: Sequence[Measurement]) -> Finding:
    """Return which of displacement and velocity is turned: the velocity if the force speeds it."""
    power = _power(runs)
    begin = "Displacement and velocity have opposite signs: "
    if abs(power) < SENSOR.resists:
        text = f"{begin}one of the two is reversed."
        return _fault("sign", "velocity", -1.0, 0.0, text, "displacement")
    channel = "velocity" if power < 0.0 else "displacement"
    verb = "speed up" if power < 0.0 else "resist"
    text = f"{begin}the force seems to {verb} the velocity, so {channel} is reversed."
    return _fault("sign", channel, -1.0, 0.0, text)


def _power(runs: Sequence[Measurement]) -> float:
    """Return the mean of force times velocity over that of its size: 1 for a plain damper.

    0 where no run has both.
    """
    able = [run for run in runs if run.has("force", "velocity")]
    if not able:
        return 0.0
    power = np.concatenate([run["force"] * run["velocity"] for run in able])
    return float(power.mean() / max(float(np.mean(np.abs(power))), 1e-300))


def _mean_step(runs: Sequence[Measurement]) -> float:
    """Return the mean sampling step [s] over all samples, as what is pooled over runs has it."""
    samples = [len(run.time) for run in runs]
    return float(np.average([run.step for run in runs], weights=samples))


def _late(theta: Array, std: Array, step: float) -> list[Finding]:
    """Return a delay of one channel, or a lag of the velocity's instrument."""
    late, late_std = float(theta[1]), float(std[1])
    if abs(late) <= max(SENSOR.fault_sigma * late_std, SENSOR.least_delay * step):
        return []
    order = _order(theta, std) if late > 0.0 else 0
    if order:
        text = (
            f"Velocity lags the rate of displacement by {1e3 * late:.2f} ms and rounds it, as an "
            f"instrument of {'first' if order == 1 else 'second'} order does."
        )
        return [_fault("lag", "velocity", late, late_std, text)]
    channel = "velocity" if late > 0.0 else "displacement"
    text = f"{channel.capitalize()} is {1e3 * abs(late):.2f} ms late relative to the other."
    return [_fault("delay", channel, abs(late), late_std, text)]


def _order(theta: Array, std: Array) -> int:
    """Return the order of an instrument that lags, 0 for a plain delay.

    A delay D has E = D^2/2 and F = D^3/6; an instrument v + D v' + E v'' of what it shows has F = 0
    and, of first order, E = 0.
    """
    late = float(theta[1])
    second, third = theta[2] / late**2, theta[3] / late**3
    second_std, third_std = std[2] / late**2, std[3] / late**3
    shift = abs(second - 0.5) / second_std + abs(third - 1.0 / 6.0) / third_std
    if abs(second) / second_std + abs(third) / third_std < shift:
        return 1
    # The series ends at F: of a long delay E is off by some hundredths.
    bent = (
        abs(second - 0.5) > 0.06 + SENSOR.fault_sigma * second_std
        and abs(third) < 1.0 / 12.0 + third_std
    )
    ends = 1.0 / 6.0 - third > 0.5 * SENSOR.fault_sigma * third_std and abs(third) < 0.05
    return 2 if bent or ends else 0


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


def _unrelated_share(runs: Sequence[Measurement]) -> float:
    """Return which share of the displacement's power no fit of the velocity explains."""
    pieces = [piece for run in runs for piece in _pieces(run)]
    theta, _ = _pooled(runs)
    left = sum(float(np.sum((b - A @ theta) ** 2)) for A, b in pieces)
    return left / max(sum(float(b @ b) for _, b in pieces), 1e-300)


def _pieces(run: Measurement) -> list[tuple[Array, Array]]:
    """Return the columns (n, 6) and the displacement (n,) of each piece, means removed."""
    dt = run.step
    corner = min(LOW_PASS, 0.2 / dt)
    filtered = butter(4, 2.0 * dt * corner, output="sos")
    x, v = (sosfiltfilt(filtered, run[name]) for name in ("displacement", "velocity"))
    a = np.gradient(v, dt)
    whole = np.column_stack([_integral(v, dt), v, a, np.gradient(a, dt)])
    size = _size(run)
    out = []
    for begin in _begins(run):
        part = slice(begin, begin + size)
        first = whole[part, 0] - whole[part, 0].mean()
        t = dt * np.arange(len(first))
        A = np.column_stack([first, whole[part, 1:], _integral(first, dt), t])
        out.append((A - A.mean(axis=0), x[part] - x[part].mean()))
    return out


def _size(run: Measurement) -> int:
    return max(40, round(WINDOW / run.step))


def _begins(run: Measurement) -> range:
    """Return the samples at which the pieces of a run begin."""
    return range(0, len(run.time) - _size(run) // 2, _size(run))


def _integral(values: Array, dt: float) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * dt * (values[1:] + values[:-1]))])


def signs(runs: Sequence[Measurement], known: Sequence[Finding]) -> list[Finding]:
    """Return force or motion that is turned: a damper that yields energy; a voltage below zero."""
    found = []
    turned = any(fault.kind == "sign" for fault in known)
    if not turned and _power(runs) < -SENSOR.resists:
        text = (
            "Force times velocity is negative on average: a damper would feed energy in. The sign "
            "of the force, or of the motion, is reversed."
        )
        found.append(_fault("sign", "force", -1.0, 0.0, text))
    for drive in ("voltage", "duty"):  # a current or a field may well be driven both ways
        drives = [run[drive] for run in runs if run.has(drive)]
        if not drives:
            continue
        V = np.concatenate(drives)
        low, high = np.quantile(V, [0.02, 0.98])
        if low < 0.0 and -low > SENSOR.turned * max(high, 0.0):
            text = f"The {drive} is negative nearly always: its sign is reversed."
            found.append(_fault("sign", drive, -1.0, 0.0, text))
    return found
