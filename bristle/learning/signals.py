"""The signals along which a missing part may be learned: as histories, and as source of a hook."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from scipy.signal import bilinear, lfilter, lfilter_zi

from ..core.arrays import Array
from ..identification.problem import Run

TIMES = (0.02, 0.1, 0.5, 2.5)
"""Time constants [s] at which a memory is looked at."""

WAYS = (0.3, 1.5)
"""Travels that wear a structure down which rebuilds at rest, in RMS displacements."""

EARLY = 0.02
"""Age [s] over which the logarithm of a contact's age begins to grow, where the scan looks."""

_AGED = """    rate = abs(q.v) / p.way
    if rate * q.dt > 1e-9:
        kept = exp(-rate * q.dt)
        return ((1.0 - kept) / rate + z.age * kept,)
    return (z.age + q.dt,)"""

_FADING = "    return ({signal} + (z.recent - {signal}) * exp(-q.dt / p.tau),)"

_REBUILT = """    rate = 1.0 / p.tau + abs(q.v) / p.way
    rest = 1.0 / (p.tau * rate)
    return (rest + (z.built - rest) * exp(-q.dt * rate),)"""

_TRAVEL = """    if q.v * z.way < 0.0:
        return 0.0, -z.way
    way = z.way
    if way == 0.0:
        way = 1.0 if q.v > 0.0 else -1.0
    return z.travel + abs(q.v) * q.dt, way"""


_STROKE = """(
            0.5 * (1.0 + tanh(q.v / SLOW)) * interpolate(q.x, KNOTS, p.curve)
            + 0.5 * (1.0 - tanh(q.v / SLOW)) * interpolate(2.0 * p.turn - q.x, KNOTS, p.curve)
        )"""

MEMORIES = {
    "tau": ("s", "time over which it fades"),
    "way": ("m", "travel that wears it down"),
    "early": ("s", "age up to which it hardly changes"),
    "turn": ("m", "displacement at which the way back begins"),
    "frequency": ("Hz", "natural frequency of the mode"),
    "damping": ("1", "damping ratio of the mode"),
}
"""Unit and meaning of the parameters of a memory."""


GIVEN = ("turn",)
"""Those of them that the motion gives: nothing seeks or fits them."""


@dataclass(frozen=True)
class Along:
    """A signal that a curve may depend on.

    `name` and `unit` as in a verdict; `words` for sentences; `needs` the signals that a hook reads
    for it, `source` their expression there; `history` gives it (n,) of a run and its memory's
    parameters, of which `memory` has the names; `states` and `advance` are the memory of the hook,
    `starts` as in `Effect`. What changes with the direction does so over the speed SLOW in the
    hook, and at once in the history. `value` is the source of the curve's value where it is not
    that of one signal, `formula` what the signal then is. `named` says whether a formula may take
    the place of a curve along it; `contains` the signal whose curves are special cases of those
    along it. `measured` says whether it is a channel of the runs, which the model does not know.
    """

    name: str
    unit: str
    words: str
    needs: tuple[str, ...]
    source: str
    history: Callable[[Run, dict[str, float]], Array]
    states: tuple[tuple[str, str], ...] = ()
    starts: tuple[tuple[str, str], ...] = ()
    advance: str = ""
    memory: tuple[str, ...] = ()
    value: str = ""
    formula: str = ""
    named: bool = True
    contains: str = ""
    measured: bool = False

    def memories(
        self, dt: float, length: float, stroke: float, top: float
    ) -> list[dict[str, float]]:
        """Return the parameters of its memory to look at.

        Parameters
        ----------
        dt, length : step and length of the runs [s]
        stroke, top : their RMS displacement and the largest one [m]
        """
        grids = {
            "tau": [tau for tau in TIMES if 2.0 * dt <= tau <= length / 3.0],
            "way": [share * stroke for share in WAYS],
            "early": [EARLY],
            "turn": [top],
        }
        return [
            dict(zip(self.memory, node, strict=True))
            for node in product(*(grids[n] for n in self.memory))
        ]

    def limits(self, dt: float, stroke: float) -> dict[str, tuple[float, float]]:
        """Return between which values a parameter of its memory is sought.

        Parameters
        ----------
        dt : step of the runs [s]
        stroke : their RMS displacement [m]
        """
        known = {
            "tau": (max(TIMES[0], 2.0 * dt), 4.0 * TIMES[-1]),
            "way": (0.3 * WAYS[0] * stroke, 3.0 * WAYS[-1] * stroke),
            "early": (0.05 * EARLY, 50.0 * EARLY),
        }
        return {name: known[name] for name in self.memory if name not in GIVEN}


def faded(signal: Array, dt: float, tau: float, begin: float) -> Array:
    """Return a signal (n,) behind a first-order lag.

    Parameters
    ----------
    signal : (n,) in its unit
    dt, tau : sampling step and time constant [s]
    begin : what the lag shows at the first sample
    """
    keep = float(np.exp(-dt / tau))
    middle = np.append(signal[:1], 0.5 * (signal[1:] + signal[:-1]))
    out = lfilter([1.0 - keep], [1.0, -keep], middle[1:], zi=[keep * begin])[0]
    return np.append(np.float64(begin), out)


def travel_since_reversal(run: Run, _memory: dict[str, float]) -> Array:
    """Return the travel (n,) [m] since the velocity last changed sign."""
    steps = np.append(0.0, 0.5 * (np.abs(run.v[1:]) + np.abs(run.v[:-1])) * run.dt)
    total = np.cumsum(steps)
    turned = np.append(True, run.v[1:] * run.v[:-1] < 0.0)
    last = np.maximum.accumulate(np.where(turned, np.arange(len(total)), 0))
    return np.asarray(total - total[last])


def rebuilt(run: Run, memory: dict[str, float]) -> Array:
    """Return a structure (n,) that rebuilds at rest and is worn down by travel, 1 when whole.

    Moore (1959), Trans. Br. Ceram. Soc. 58, 470-494: its rate is (1 - s)/tau - s |v|/way.
    """
    speed = np.append(0.0, 0.5 * (np.abs(run.v[1:]) + np.abs(run.v[:-1])))
    rate = 1.0 / memory["tau"] + speed / memory["way"]
    rest, keep = 1.0 / (memory["tau"] * rate), np.exp(-run.dt * rate)
    out, now = np.empty(len(speed)), 0.0
    for k in range(len(speed)):
        now = rest[k] + (now - rest[k]) * keep[k] if k else 0.0
        out[k] = now
    return out


def aged(run: Run, memory: dict[str, float]) -> Array:
    """Return the logarithm (n,) of the age of a contact that travel renews: ln(1 + q/early).

    Its age q [s] grows by 1 - |v| q/way: the ageing law of Dieterich (1979), J. Geophys. Res. 84,
    2161-2168, and Ruina (1983), J. Geophys. Res. 88, 10359-10370.
    """
    speed = np.append(0.0, 0.5 * (np.abs(run.v[1:]) + np.abs(run.v[:-1])))
    worn = run.dt * speed / memory["way"]
    kept = np.exp(-worn)
    grown = run.dt * np.where(worn > 1e-9, (1.0 - kept) / np.maximum(worn, 1e-9), 1.0)
    out, now = np.empty(len(speed)), 0.0
    for k in range(len(speed)):
        now = grown[k] + now * kept[k] if k else 0.0
        out[k] = now
    return np.asarray(np.log(1.0 + out / memory["early"]))


def _fading(name: str, unit: str, words: str, signal: str, needs: str, start: str) -> Along:
    def history(run: Run, memory: dict[str, float]) -> Array:
        now = np.abs(run.v) if signal == "abs(q.v)" else getattr(run, needs)
        return faded(now, run.dt, memory["tau"], float(now[0]) if start else 0.0)

    return Along(
        name, unit, words, (needs, "dt"), "z.recent", history, (("recent", unit),),
        (("recent", start),) if start else (), _FADING.format(signal=signal), ("tau",),
    )  # fmt: skip


ALONG = {
    one.name: one
    for one in (
        Along("displacement", "m", "displacement", ("x",), "q.x", lambda run, _: run.x),
        Along(
            "stroke", "m", "displacement and direction", ("x", "v"), "q.x",
            lambda run, memory: np.where(run.v > 0.0, run.x, 2.0 * memory["turn"] - run.x),
            memory=("turn",), value=_STROKE,
            formula="x where v > 0, else 2 turn - x", named=False, contains="displacement",
        ),
        Along("velocity", "m/s", "velocity", ("v",), "q.v", lambda run, _: run.v),
        Along("speed", "m/s", "speed", ("v",), "abs(q.v)", lambda run, _: np.abs(run.v)),
        Along("acceleration", "m/s2", "acceleration", ("a",), "q.a", lambda run, _: run.a),
        Along("voltage", "V", "the command", ("V",), "q.V", lambda run, _: run.V),
        Along(
            "slowing", "m/s2", "acceleration along the motion", ("v", "a"),
            "(q.a * tanh(q.v / SLOW))",  # in brackets, for a formula may take its square
            lambda run, _: np.where(run.v > 0.0, run.a, -run.a),
        ),
        Along(
            "travel", "m", "travel since the last reversal", ("v", "dt"), "z.travel",
            travel_since_reversal, (("travel", "m"), ("way", "1")), (), _TRAVEL,
        ),
        Along(
            "rebuilding", "1", "a structure that rebuilds at rest", ("v", "dt"), "z.built", rebuilt,
            (("built", "1"),), (), _REBUILT, ("tau", "way"),
        ),
        Along(
            "age", "1", "the logarithm of the contact's age, which travel renews", ("v", "dt"),
            "log(1.0 + z.age / p.early)", aged, (("age", "s"),), (), _AGED, ("early", "way"),
        ),
        _fading("recent_displacement", "m", "recent displacement", "q.x", "x", "x"),
        _fading("recent_speed", "m/s", "recent speed", "abs(q.v)", "v", ""),
        _fading("recent_voltage", "V", "recent command", "q.V", "V", "V"),
    )
}  # fmt: skip

FOLLOWING = "signal"
"""The parameter of a learned effect that follows a measured channel."""


def measured_signal(name: str, unit: str) -> Along:
    """Return a channel beside those that bristle knows as a signal.

    Parameters
    ----------
    name : of the channel
    unit : its own, "1" where bristle does not know it
    """

    def history(run: Run, _: dict[str, float]) -> Array:
        return run.extra[name].values

    words = name.replace("_", " ")
    return Along(name, unit, words, (), f"p.{FOLLOWING}", history, measured=True)


def measured_signals(runs: Sequence[Run]) -> list[Along]:
    """Return the channels that all runs hold beside those that bristle knows, as signals."""
    known = runs[0].extra
    shared = [name for name in known if all(name in run.extra for run in runs)]
    return [measured_signal(name, known[name].known_unit) for name in shared]


# A mode of what holds the load cell: the force that it shows rings.
#
#     shown = F + share (r - F),   r'' + 2 damping w r' + w^2 r = w^2 F,   w = 2 pi frequency
#
# Meirovitch (2001), Fundamentals of Vibrations, ch. 3: a mass on a spring and a dashpot. Steps are
# those of the trapezoidal rule, here and in the effect's file, so that both are the same mode.

RING = "resonance"
"""Name of the part of the model that this mode is, and of what its share depends on."""

ADVANCE = """    w = 6.283185307179586 * p.frequency
    half = 0.5 * q.dt
    loss, stiff = 2.0 * p.damping * w * half, (w * half) ** 2
    push = half * w * w * (z.last + q.value - 2.0 * z.ring)
    rate = (z.rate * (1.0 - loss - stiff) + push) / (1.0 + loss + stiff)
    return z.ring + half * (z.rate + rate), rate, q.value"""

SIGNAL = Along(  # it follows the force, which is no signal of the motion: `modes` scans it
    RING, "1", "a mode of what holds the load cell", ("value", "dt"), "",
    lambda run, _: np.zeros(len(run.force)),
    (("ring", "N"), ("rate", "N/s"), ("last", "N")), (("ring", "value"), ("last", "value")),
    ADVANCE, ("frequency", "damping"),
)  # fmt: skip


def frequencies(dt: float, length: float) -> Array:
    """Return the frequencies (k,) [Hz] at which the scan looks.

    Parameters
    ----------
    dt, length : step and length of the runs [s]
    """
    low, high = 5.0 / length, 0.2 / dt
    count = max(2, 1 + int(np.ceil(np.log(high / low) / np.log(1.08))))
    return np.geomspace(low, high, count) if high > low else np.array([])


@lru_cache(maxsize=8)
def _filter(dt: float, frequency: float, damping: float) -> tuple[Array, Array]:
    w = 2.0 * np.pi * frequency
    b, a = bilinear([w * w], [1.0, 2.0 * damping * w, w * w], 1.0 / dt)
    return np.asarray(b), np.asarray(a)


def ringing(force: Array, dt: float, frequency: float, damping: float) -> Array:
    """Return r - F (n,) [N], at rest at the first sample.

    Parameters
    ----------
    force : F (n,) [N]
    dt : step [s]
    frequency, damping : Hz and ratio
    """
    b, a = _filter(dt, frequency, damping)
    shown, _ = lfilter(b, a, force, zi=lfilter_zi(b, a) * force[0])
    return np.asarray(shown - force)


def response(share: float, frequency: float, damping: float, at: Array) -> Array:
    """Return shown over true force (n,), the amplitude.

    Parameters
    ----------
    share, frequency, damping : of the mode: 1, Hz, 1
    at : frequencies (n,) [Hz]
    """
    s = 1j * at / frequency
    mode = 1.0 / (1.0 + 2.0 * damping * s + s * s)
    return np.asarray(np.abs(1.0 + share * (mode - 1.0)))


# Parallel elastic-slip elements: springs, each with a slider that gives way beyond a travel.
#
# Iwan (1966), J. Appl. Mech. 33(4), 893-900; the same are called Maxwell-slip elements, and their
# forces are the weights of a Prandtl-Ishlinskii operator: play and breakaway after a reversal.

SLIP = "slip"
"""Name of the part of the model that these elements are, and of what their forces depend on."""

SHARES = tuple(0.02 * 1.5**k for k in range(12))
"""Travels at which the elements give way, in RMS displacements."""


def slips(run: Run, travels: Array) -> Array:
    """Return the states (n, k) of elements of some travels (k,) [m]: -1 to 1, where they slip."""
    steps = np.diff(run.x, prepend=run.x[:1])
    out, now = np.empty((len(steps), len(travels))), np.zeros(len(travels))
    ways = steps[:, None] / travels
    for k in range(len(steps)):
        now = np.minimum(np.maximum(now + ways[k], -1.0), 1.0)
        out[k] = now
    return out


def signal_of(travels: Sequence[float]) -> Along:
    """Return what elements of some travels [m] need in a hook; `history` gives their states (n, k).

    Parameters
    ----------
    travels : at which they give way, ascending
    """
    names = [f"slip_{k}" for k, _ in enumerate(travels, 1)]
    moved = [
        f"    {name} = min(max(z.{name} + q.v * q.dt / KNOTS[{k}], -1.0), 1.0)"
        for k, name in enumerate(names)
    ]
    return Along(
        SLIP, "m", "the travel at which each gives way", ("v", "dt"), "",
        lambda run, _: slips(run, np.array(travels)),
        tuple((name, "1") for name in names), (),
        "\n".join([*moved, f"    return ({', '.join(names)},)"]),
    )  # fmt: skip


def force_source(count: int) -> str:
    """Return the force of a number of elements as a hook computes it."""
    return " + ".join(f"p.curve[{k}] * z.slip_{k + 1}" for k in range(count))
