"""One motion from displacement and velocity with its uncertainty; a drive without its noise.

Noise on the inputs decides everything: near v = 0 a yield law turns 1 % of velocity noise into ten
times the noise of the force. So the two channels are joined by a Kalman smoother with white jerk
(Rauch, Tung & Striebel 1965, AIAA Journal 3(8)), its intensity by maximum likelihood, and samples
of what it leaves uncertain are drawn by smoothing simulated noise (Durbin & Koopman 2002,
Biometrika 89(3), 603-615).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter, uniform_filter1d
from scipy.optimize import minimize_scalar
from scipy.signal import istft, stft

from ..core.arrays import Array
from .kalman import Samples, Smoothed, kalman_smooth, room

GROUP = 12
"""Draws whose mean is zero together: any multiple of them may be used for an expectation."""

EDGE = 25
"""Samples at either end in which the smoother has not settled."""

SPAN = 1.0
"""Time [s] over which a short-time spectrum is taken."""

ALIKE = (3, 5)
"""Frequencies and times, in steps of that spectrum, over which a power is averaged."""

MASKED = 1.1
"""How many times the noise's mean power is called noise, for it scatters."""

WINDOW = 51
"""Samples over which the power of what was left out is averaged."""

LUCK = 1.5
"""How much more than on average noise gives in such a window without being motion."""


@dataclass(frozen=True)
class SmoothedMotion:
    """A smoothed motion.

    `x`, `v`, `a` (n,) m, m/s, m/s2; `std` (3,) their standard deviations away from the ends;
    `jerk` the intensity of the white jerk [m2/s5]; `mismatch` the RMS of the normalised innovations
    of each channel (2,), 1 where they agree within their noise; the jerk gives way to a channel of
    wrong gain, so that a fault moves it only a little.
    """

    x: Array
    v: Array
    a: Array
    std: Array
    jerk: float
    mismatch: Array


def smooth(
    x: Array | None, v: Array | None, dt: float, noise: tuple[float, float], jerk: float = 0.0
) -> SmoothedMotion:
    """Return the motion that displacement and velocity agree on.

    Parameters
    ----------
    x, v : (n,) m, m/s; either may be None; what is not finite counts as not measured
    dt : float, s
    noise : standard deviations of the two channels [m, m/s]
    jerk : intensity of the white jerk [m2/s5]; 0: by maximum likelihood
    """
    given = x if x is not None else v
    assert given is not None
    y = np.zeros((len(given), 3))
    if x is not None:
        y[:, 0] = x
    if v is not None:
        y[:, 1] = v
    samples = _samples(y, noise, (x is not None, v is not None), dt)
    if jerk <= 0.0:
        jerk = _likeliest(samples)
    out = _smoothed(samples, jerk)
    return SmoothedMotion(
        out.state[:, 0].copy(), out.state[:, 1].copy(), out.state[:, 2].copy(),
        np.sqrt(np.maximum(out.cov, 0.0)), jerk, np.sqrt(out.loss[:2]),
    )  # fmt: skip


def _samples(y: Array, noise: tuple[float, float], have: tuple[bool, bool], dt: float) -> Samples:
    """Return displacement and velocity in y (n, 3), with what they tell before the first sample."""
    r = np.array([max(one, 1e-15) ** 2 for one in noise] + [0.0])
    there = np.array([*have, False])
    seen = y[:, 0 if have[0] else 1]
    finite = np.isfinite(seen)
    pairs = finite[1:] & finite[:-1]
    fastest = float(np.max(np.abs(np.diff(seen)[pairs]) / dt, initial=0.0))
    mean, cov = np.zeros(3), np.zeros(6)
    if have[0]:
        mean[0] = seen[finite][0] if finite.any() else 0.0
        cov[0] = 4.0 * r[0] + 1e-30
        speed = fastest
    else:
        cov[0] = 1e-30  # where the motion begins is not known: it is called zero
    if have[1]:
        velocity = y[:, 1][np.isfinite(y[:, 1])]
        mean[1] = velocity[0] if len(velocity) else 0.0
        speed = 2.0 * float(np.sqrt(r[1])) if len(velocity) else 0.0
    cov[3] = speed * speed + 1e-30
    cov[5] = (2.0 * fastest / dt if have[0] else 2.0 * fastest) ** 2 + 1e-30
    if all(have):
        cov[5] = 1e4 * r[1] / (dt * dt) / len(y) + 1e-30
    return Samples(y, r, there, dt, mean, cov)


def _smoothed(samples: Samples, jerk: float) -> Smoothed:
    out = room(len(samples.y))
    kalman_smooth(samples, np.full(len(samples.y), jerk), out)
    return out


def _likeliest(samples: Samples) -> float:
    """Return the intensity of the white jerk that makes the measurement likeliest."""
    y, dt = samples.y, samples.dt
    path = y[:, 0] if samples.have[0] else np.cumsum(np.nan_to_num(y[:, 1])) * dt
    third = np.diff(path[np.isfinite(path)], n=3) / dt**3
    top = np.log10(np.var(third) * dt + 1e-30)

    def cost(exponent: float) -> float:
        return kalman_smooth(samples, np.full(len(y), 10.0**exponent))

    grid = np.arange(top - 14.0, top + 1.0, 1.0)
    best = grid[int(np.argmin([cost(exponent) for exponent in grid]))]
    found = minimize_scalar(
        cost, bounds=(best - 1.0, best + 1.0), method="bounded", options={"xatol": 0.05}
    )
    return float(10.0**found.x)


def posterior_draws(
    n: int, dt: float, noise: tuple[float, float], jerk: float, have: tuple[bool, bool], draws: int,
    seed: int = 0, motion: SmoothedMotion | None = None,
) -> Array:  # fmt: skip
    """Return draws (draws, n, 3) of the smoother's error of x, v, a [m, m/s, m/s2].

    The error of a linear smoother S is noise that it lets pass, and motion that it takes for noise:
    x - S y = (1 - S) x - S n. The first is drawn by smoothing simulated noise. The second is the
    same in every draw: it is taken from the motion that was found, where it is given, for what
    laboratories prescribe is far smoother than white jerk; else from random motions of this jerk.

    Parameters
    ----------
    n, dt : number of samples, sampling step [s]
    noise : standard deviations of displacement and velocity [m, m/s]
    jerk : intensity of the white jerk [m2/s5]
    have : whether displacement and velocity were measured
    draws, seed : how many draws, and their seed
    motion : the motion that was found, (n,); None where there is none
    """
    out, left = _errors_drawn(n, dt, noise, jerk, have, draws, seed, motion)
    if motion is not None and draws:
        out[:, :, 2] = _by_spectrum(motion.a, out[:, :, 2], dt)
    return out + left


def _errors_drawn(
    n: int, dt: float, noise: tuple[float, float], jerk: float, have: tuple[bool, bool], draws: int,
    seed: int, motion: SmoothedMotion | None,
) -> tuple[Array, Array]:  # fmt: skip
    """Return draws (draws, n, 3) of the noise let pass, and the motion (n, 3) taken for noise.

    Whatever the time and frequency: of an acceleration, less of the noise is an error.
    """
    generator = np.random.default_rng(seed)
    std = np.array([max(one, 1e-15) for one in noise])
    out = np.zeros((draws, n, 3))
    lead = min(200, n) if motion is None else 0
    total = n + 2 * lead
    for d in range(draws):
        truth = np.zeros((total, 3))
        if motion is None:
            truth = random_motion(generator, total, dt, jerk)
        y = truth.copy()
        y[:, :2] += generator.standard_normal((total, 2)) * std
        state = _smoothed(_samples(y, noise, have, dt), jerk).state
        out[d] = (truth - state)[lead : lead + n]
    _centre(out)
    if motion is None or not draws:
        return out, np.zeros((n, 3))
    return out, _left_out(motion, out[0], noise, have, dt)


class MovingPart:
    """Which part of a smoothed acceleration is motion, by time and frequency.

    White jerk is a wide guess: the smoother lets noise pass at frequencies where nothing moves.
    Where the noise makes up the power of what is seen, that is expected to be noise, and no more
    (Wiener's filter on the short-time spectrum, as in speech: Lim & Oppenheim 1979, Proc. IEEE 67,
    1586-1604).

    Parameters
    ----------
    noise : (d, n) draws of the noise that a smoother lets pass
    dt : step [s]
    """

    def __init__(self, noise: Array, dt: float) -> None:
        self._n, self._dt = noise.shape[1], dt
        self._size = int(min(max(round(SPAN / dt), 64), self._n // 4))
        self.drawn = [self.spectrum(draw) for draw in noise]
        power = [np.mean(np.abs(Z[:, 2:-2]) ** 2, axis=1) for Z in self.drawn]
        self._noise = np.mean(power, axis=0)[:, None]

    def spectrum(self, y: Array) -> NDArray[np.complex128]:
        """Return the short-time spectrum of a signal (n,)."""
        seen: NDArray[np.complex128] = stft(y, nperseg=self._size, noverlap=self._size * 3 // 4)[2]
        return seen

    def signal(self, Z: NDArray[np.complex128]) -> Array:
        """Return the signal (n,) of a short-time spectrum."""
        made = istft(Z, nperseg=self._size, noverlap=self._size * 3 // 4)[1]
        return np.asarray(made[: self._n], dtype=float)

    def share(self, Z: NDArray[np.complex128]) -> Array:
        """Return which share of a spectrum's power is motion."""
        power = uniform_filter(np.abs(Z) ** 2, ALIKE)
        noise: Array = np.clip(MASKED * self._noise / np.maximum(power, 1e-300), 0.0, 1.0)
        return 1.0 - noise

    def still(self, a: Array, integrals: Sequence[int] = (0,)) -> Array:
        """Return what of an acceleration (n,) is noise, integrated so many times (n, k).

        Nothing at the ends, where windows end.
        """
        Z = self.spectrum(a)
        once = np.zeros((len(Z), 1), dtype=complex)
        once[1:, 0] = 1.0 / (2j * np.pi * np.fft.rfftfreq(self._size, self._dt)[1:])
        parts = [self.signal((1.0 - self.share(Z)) * Z * once**k) for k in integrals]
        near = np.minimum(np.arange(self._n), np.arange(self._n)[::-1])
        return np.stack(parts, axis=1) * np.minimum(near / (4.0 * EDGE), 1.0)[:, None]


def _by_spectrum(a: Array, draws: Array, dt: float) -> Array:
    """Return draws (d, n) of the error of a smoothed acceleration (n,), known for the most part.

    A parameter that multiplies the acceleration comes out too small by the noise in it, for that
    goes along with the estimate. So what does not move is expected to be wrong by itself.
    """
    moving = MovingPart(draws, dt)
    root = np.sqrt(moving.share(moving.spectrum(a)))
    return np.array([moving.signal(root * Z) for Z in moving.drawn]) - moving.still(a)[:, 0]


def _centre(draws: Array) -> None:
    """Take the mean off groups of draws, in place, so that it is not read as a known error."""
    for begin in range(0, len(draws), GROUP):
        group = draws[begin : begin + GROUP]
        if len(group) > 1:
            group -= group.mean(axis=0)
            group *= np.sqrt(len(group) / (len(group) - 1.0))


def _left_out(
    motion: SmoothedMotion,
    draw: Array,
    noise: tuple[float, float],
    have: tuple[bool, bool],
    dt: float,
) -> Array:
    """Return what the smoother takes off the motion (n, 3): what it would take off its own result.

    That result holds noise, of which some is taken off as well; were it counted, an error would be
    expected just where, and with the other sign than, one was made. How much of it there is says
    the smoothed noise of a `draw` (n, 3); by the rest of the local power the difference counts
    (Wiener).
    """
    path = np.column_stack([motion.x, motion.v, motion.a])
    twice, noisy = (
        _smoothed(_samples(y, noise, have, dt), motion.jerk).state for y in (path, draw)
    )
    left = path - twice
    edge = min(EDGE, len(draw) // 4)
    chance = np.mean((draw - noisy)[edge : len(draw) - edge] ** 2, axis=0)
    power = uniform_filter1d(left**2, min(WINDOW, len(left)), axis=0)
    count: Array = np.maximum(1.0 - LUCK * chance / np.maximum(power, 1e-300), 0.0)
    return count * left


def random_motion(
    generator: np.random.Generator, n: int, dt: float, jerk: float, times: Array | float = 1.0
) -> Array:
    """Return a motion (n, 3) of white jerk, from rest [m, m/s, m/s2].

    Parameters
    ----------
    generator : source of the random numbers, moved on
    n, dt : number of samples, sampling step [s]
    jerk : intensity [m2/s5]
    times : (n,) how many times as intense it is at each sample
    """
    Q = np.array(
        [
            [dt**4 / 20.0, dt**3 / 8.0, dt**2 / 6.0],
            [dt**3 / 8.0, dt**2 / 3.0, dt / 2.0],
            [dt**2 / 6.0, dt / 2.0, 1.0],
        ]
    ) * (jerk * dt)
    root = np.linalg.cholesky(Q + np.eye(3) * 1e-30 * max(jerk, 1.0))
    steps = generator.standard_normal((n, 3)) @ root.T * np.sqrt(times).reshape(-1, 1)
    path = np.zeros((n, 3))
    x, v, a = path.T
    a[1:] = np.cumsum(steps[1:, 2])
    v[1:] = np.cumsum(steps[1:, 1] + dt * a[:-1])
    x[1:] = np.cumsum(steps[1:, 0] + dt * v[:-1] + 0.5 * dt * dt * a[:-1])
    return path


# A voltage or current without its noise but with its steps, and what that leaves uncertain.
#
# Laboratories drive a damper by steps or by smooth signals. Steps are found as changes of the mean
# (binary segmentation: Scott & Knott 1974, Biometrics 30(3), 507-512) and averaged between; what is
# not flat between its jumps goes through the smoother of the motion.

_WINDOW = 10  # samples on either side in which a jump of the signal shows
_PIECE = 15  # samples that levels last at least, on average; shorter ones are no steps
_CHANCE = 30.0  # gain of a change of mean, in variances of the noise, that chance does not reach


def smooth_drive(V: Array, noise: float, dt: float, draws: int, seed: int) -> tuple[Array, Array]:
    """Return a drive signal (n,) smoothed, and draws (draws, n) of the error that is left.

    Parameters
    ----------
    V : (n,) V or A
    noise : standard deviation in the same unit
    dt : sampling step [s]
    draws, seed : how many draws of the error, and their seed
    """
    generator = np.random.default_rng(seed)
    error = np.zeros((draws, len(V)))
    if noise <= 1e-4 * max(float(np.ptp(V)), 1e-12) or len(V) < 4 * _WINDOW:
        return V.copy(), error
    edges = _levels(V, noise)
    stepped = edges is not None
    edges = edges if edges is not None else [0, *_jumps(V, noise), len(V)]
    out = np.empty_like(V)
    for begin, end in pairwise(edges):
        piece, part = V[begin:end], slice(begin, end)
        if stepped or end - begin < 4 or np.std(piece) < 1.1 * noise:
            out[part] = piece.mean()
            left = noise / np.sqrt(end - begin)
            error[:, part] = left * generator.standard_normal((draws, 1))
        elif end - begin < 4 * _WINDOW:
            out[part] = _local_line(piece, _WINDOW)
            error[:, part] = 0.4 * noise * generator.standard_normal((draws, 1))
        else:
            found = smooth(piece, None, dt, (noise, 1.0))
            out[part] = found.x
            own = (noise, 1.0), found.jerk, (True, False), draws, seed + begin, found
            passed, left = _errors_drawn(end - begin, dt, *own)
            error[:, part] = (passed + left)[:, :, 0]
    return out, error


def smooth_steps(V: Array, noise: float, dt: float = 0.002) -> tuple[Array, float]:
    """Return a drive signal (n,) smoothed and the RMS of the error that is left."""
    out, error = smooth_drive(V, noise, dt, 8, 0)
    return out, float(np.sqrt(np.mean(error**2)))


def _levels(V: Array, noise: float) -> list[int] | None:
    """Return the edges between levels, the ends included; None where they do not make the signal.

    They do if what is left is no more than the noise, and levels last.
    """
    total = np.concatenate([[0.0], np.cumsum(V - V.mean())])
    edges, open_parts = [0, len(V)], [(0, len(V))]
    while open_parts:
        begin, end = open_parts.pop()
        at, gain = _best_split(total, begin, end)
        if gain > _CHANCE * noise * noise:
            edges.append(at)
            open_parts += [(begin, at), (at, end)]
            if len(edges) > len(V) // _PIECE:
                return None
    edges.sort()
    for _ in range(2):  # the first splits were made before their neighbours were known
        for i in range(1, len(edges) - 1):
            edges[i] = _best_split(total, edges[i - 1], edges[i + 1])[0]
    level = np.concatenate([np.full(e - b, V[b:e].mean()) for b, e in pairwise(edges)])
    return edges if np.std(V - level) <= 1.1 * noise else None


def _best_split(total: Array, begin: int, end: int) -> tuple[int, float]:
    """Return where two means explain a part best, and by how much the sum of squares falls."""
    n = end - begin
    if n < 4:
        return begin + n // 2, 0.0
    k = np.arange(1, n)
    apart = total[begin + 1 : end] - total[begin] - k / n * (total[end] - total[begin])
    gain = apart**2 * n / (k * (n - k))
    best = int(np.argmax(gain))
    return begin + 1 + best, float(gain[best])


def _jumps(V: Array, noise: float) -> list[int]:
    """Return the samples at which the signal jumps: means on both sides differ, sharply."""
    w = _WINDOW
    total = np.concatenate([[0.0], np.cumsum(V)])
    k = np.arange(w, len(V) - w)
    after = (total[k + w] - total[k]) / w
    before = (total[k] - total[k - w]) / w
    height = np.abs(after - before)
    sharp = np.abs(V[k] - V[k - 1])
    jumps: list[int] = []
    for i in np.argsort(-height):
        if height[i] < 6.0 * noise * np.sqrt(2.0 / w):
            break
        if sharp[i] > max(0.5 * height[i], 4.0 * noise) and all(abs(k[i] - j) > w for j in jumps):
            jumps.append(int(k[i]))
    return sorted(jumps)


def _local_line(y: Array, w: int) -> Array:
    """Return the centred value of lines fitted over 2 w + 1 samples, quadratic at the ends."""
    from scipy.signal import savgol_filter

    length = min(2 * w + 1, len(y) - (len(y) + 1) % 2)
    return np.asarray(savgol_filter(y, length, min(2, length - 1)), dtype=float)
