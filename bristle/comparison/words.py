"""What an engineer would say of a comparison, from its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.arrays import Array, Flags
from ..core.text import joined, plain, quantity, short_z
from ..data.channels import UNITS
from ..physics.drive import DRIVES
from .conditions import Regime, label_sentence
from .names import name_of, site_name, site_names
from .patterns import Finder, ResidualPattern
from .predictions import SHOWN, RunPrediction, shown
from .result import Comparison

FAINT = 0.02
"""Share of an error's power below which its pattern is not worth a sentence."""
_STEP = 0.3  # numerical error, in units of the noise, that is worth a word
_SPIKY = 1.4  # plain over robust RMS from which spikes carry the error
_WHICH = {
    None: "In this measurement",
    False: "On held-out runs",
    True: "On the training runs",
}
_OF_ROLE = {"test": "On the test runs"}
_NAMED = 3  # sites that fail beside the worst one, by name
_RIPPLES = 4  # changes of sign along a coordinate from which it goes up and down
_ALIKE = 0.25  # parts of a pattern's size by which it may differ between voltages


def sentences(comparison: Comparison, finder: Finder) -> tuple[str, ...]:
    """Return three sentences: how wrong, what the error depends on, where it is right.

    Where runs have labels and the error goes with one, a fourth says so.
    """
    three = (_how_wrong(comparison), _where(comparison, finder), _where_right(comparison))
    of_labels = label_sentence(comparison.labels)
    return (*three, of_labels) if of_labels else three


def _how_wrong(comparison: Comparison) -> str:
    total = comparison.total
    known = comparison.quantity.islower()  # words; "F_kN" is a name that somebody gave an output
    what = comparison.quantity.replace("_", " ") if known else f'output "{comparison.quantity}"'
    which = _OF_ROLE.get(comparison.role) or _WHICH[comparison.seen]
    where = f"{which} the model misses"
    size = total.error.text(comparison.unit)
    step = ""
    if total.numerical_z > _STEP:
        times = plain(total.numerical_z, 2)
        step = f"; the step of the calculation alone causes {times} times the noise"
    if total.residual > _SPIKY * total.z * total.noise:
        size += ", much of it in short spikes"
    if not comparison.noise_known:
        text = f"{where} the {what} by {size}, noise included, which is not known"
    elif not comparison.right:
        times = plain(total.z)
        text = f"{where} the {what} by {size}, {times} times the noise (z){step}"
    else:
        text = f"{where} the {what} by {size}, which the noise explains (z = {total.z:.2f}){step}"
    beside = total.error.beside(comparison.unit)
    return " ".join([f"{text}{_elsewhere(comparison)}.", *beside])


def _elsewhere(comparison: Comparison) -> str:
    """Return how wrong the model is at the other sites of a building; "" on a bench."""
    others = [one for one in comparison.sites if one.site != comparison.site]
    fail = [one for one in others if one.fails]
    right = [one for one in others if one.identifiable and not one.fails]
    text = ""
    if fail:
        listed = [f"{site_name(one.site)} (z = {short_z(one.z)})" for one in fail[:_NAMED]]
        if len(fail) > _NAMED:
            listed.append(f"{len(fail) - _NAMED} more sites")
        text += f"; it fails {'' if comparison.right else 'too '}at {joined(listed)}"
    if right:
        span = f"z {min(one.z for one in right):.2f} to {max(one.z for one in right):.2f}"
        span = f"z = {right[0].z:.2f}" if len(right) == 1 else span
        are = "is right within its noise" if len(right) == 1 else "are right within their noise"
        text += f"; {site_names([one.site for one in right])} {are} ({span})"
    for why in dict.fromkeys(one.why_not for one in others if one.why_not):
        hidden = [one.site for one in others if one.why_not == why]
        text += f"; {site_names(hidden)}: {why} for a statement"
    return text


def _where(comparison: Comparison, finder: Finder) -> str:
    first = comparison.first
    if first is None or first.share < FAINT:
        if comparison.right:
            return "The remaining error looks like noise along every coordinate."
        loud = _loudest(comparison)
        most = (
            "the error beyond chance"
            if first is None
            else f"more than {_percent(first.share)} of the error"
        )
        return f"No coordinate explains {most}{f'; {loud}' if loud else ''}."
    if comparison.right:
        text = _pattern_text(first, comparison.predictions[0])
        return (
            f"A pattern is left with {name_of(first.coordinate, comparison.site)}, "
            f"{_percent(first.share)} of the error's power: {text}."
        )
    also = ""
    if first.alike:
        names = " and ".join(name_of(name, comparison.site) for name in first.alike[:2])
        also = f" (in these runs {names} show{'s' * (len(first.alike) == 1)} the same)"
    text = f"The error depends mainly on {name_of(first.coordinate, comparison.site)}{also}: "
    text += _pattern_text(first, comparison.predictions[0]) + _at_levels(first, comparison, finder)
    second = comparison.second
    if second is not None and second.share > 0.03:
        text += (
            f"; the remaining error then depends on {name_of(second.coordinate, comparison.site)}"
        )
    return text + "."


def _where_right(comparison: Comparison) -> str:
    if not comparison.noise_known:
        return "State the noise of the force in study.toml to know how much of the error is noise."
    every = comparison.regimes
    whole = (
        f"between {min(r.z for r in every):.2f} and {max(r.z for r in every):.2f}" if every else ""
    )
    right = [one for one in every if one.right]
    if every and len(right) == len(every):
        named = {"speed": "speed", "command": comparison.drive.name}
        kinds = [named[kind] for kind in named if any(getattr(r, kind) for r in every)]
        return f"It is right within its noise at every {' and '.join(kinds)} (z {whole})."
    if right:
        best = max(right, key=lambda one: (not (one.speed and one.command), one.samples))
        others = [one for one in right if _beside(one, best)]
        text = f"{capitalised(best.text)} it is right within its noise (z = {best.z:.2f})"
        if others:
            text += f", and so it is {max(others, key=lambda one: one.samples).text}"
        return text + "."
    loud = _loudest(comparison)
    if not every:
        return f"{capitalised(loud)}." if loud else "Without a speed, no regimes can be compared."
    best = min(every, key=lambda one: one.z)
    if comparison.right:
        return f"The model is best {best.text} (z = {best.z:.2f})."
    text = "The model is nowhere right within its noise. It is best "
    text += f"{best.text}, with z = {short_z(best.z)}"
    return text + (f"; {loud}." if loud else ".")


def _beside(one: Regime, best: Regime) -> bool:
    """Return whether a regime is neither the other nor a part of it."""
    if one == best:
        return False
    if one.speed and one.command and (one.speed == best.speed or one.command == best.command):
        return bool(best.speed and best.command)
    return True


def _loudest(comparison: Comparison) -> str:
    """Return which frequencies hold most of what exceeds the noise, "" where none stands out."""
    bands = [band for band in comparison.spectrum.bands if band.p < 0.001]  # none without noise
    chosen: list[int] = []
    for band in sorted(bands, key=lambda band: -band.share):
        if sum(comparison.spectrum.bands[i].share for i in chosen) > 0.7 or len(chosen) == 3:
            break
        chosen.append(comparison.spectrum.bands.index(band))
    if not chosen or max(chosen) - min(chosen) >= len(chosen):
        return ""  # scattered over the spectrum
    share = sum(comparison.spectrum.bands[i].share for i in chosen)
    low = comparison.spectrum.bands[min(chosen)].low
    high = comparison.spectrum.bands[max(chosen)].high
    span = f"below {plain(high)} Hz" if low == 0.0 else f"between {plain(low)} and {plain(high)} Hz"
    return f"{_percent(share)} of the error beyond noise lies {span}"


def _pattern_text(pattern: ResidualPattern, prediction: RunPrediction) -> str:
    """Return how a residual goes along a coordinate: "beyond 8 mm it pushes back 0.4 N more"."""
    hot = _hot(pattern)
    peak = float(np.max(np.abs(pattern.mean)))
    if not hot:
        return f"by up to {_amount(peak, prediction)}"
    clear = pattern.mean[np.abs(pattern.mean) > 2.0 * pattern.std]
    changes = int(np.count_nonzero(np.diff(np.sign(clear))))
    if changes >= _RIPPLES and pattern.coordinate in ("displacement", "velocity", "acceleration"):
        most = _amount(peak, prediction)
        return f"it goes up and down {changes + 1} times along it, by up to {most}"
    mirrored = _mirrored(pattern, hot, prediction)
    if mirrored:
        return mirrored
    return "; ".join(_one(pattern, begin, end, prediction) for begin, end in hot[:2])


def _amount(value: float, prediction: RunPrediction) -> str:
    """Return an amount of what is compared, in the unit that the whole of it is read in."""
    whole = float(np.sqrt(np.mean(prediction.measured**2)))
    return quantity(value, prediction.unit, 2, whole)


def _hot(pattern: ResidualPattern) -> list[tuple[int, int]]:
    """Return stretches of bins (first, last) where the mean is large and clear, largest first."""
    mean = pattern.mean
    top = float(np.max(np.abs(mean)))
    large = np.abs(mean) >= 0.5 * top
    clear = np.abs(mean) > 2.0 * pattern.std
    out: list[tuple[int, int]] = []
    for i in np.flatnonzero(large):
        if out and out[-1][1] == i - 1 and mean[i] * mean[i - 1] > 0.0:
            out[-1] = (out[-1][0], int(i))
        else:
            out.append((int(i), int(i)))
    out = [(i, j) for i, j in out if clear[i : j + 1].any()]
    return sorted(out, key=lambda pair: -float(np.sum(np.abs(mean[pair[0] : pair[1] + 1]))))


def _mirrored(
    pattern: ResidualPattern, hot: list[tuple[int, int]], prediction: RunPrediction
) -> str:
    """Return the words for a pattern that is alike, or opposite, on both sides of zero."""
    if len(hot) < 2 or pattern.coordinate not in ("displacement", "velocity", "acceleration"):
        return ""
    (a, b), (c, d) = sorted(hot[:2])
    ends = max(1, len(pattern.mean) // 16)  # the outermost bins may hold too few blocks
    if a > ends or d < len(pattern.mean) - 1 - ends:
        return ""
    if pattern.high[b] >= 0.0 or pattern.low[c] <= 0.0:
        return ""
    factor, unit = SHOWN[pattern.coordinate]
    edge = factor * 0.5 * float(pattern.low[c] - pattern.high[b])
    left, right = _largest(pattern.mean, a, b), _largest(pattern.mean, c, d)
    size = 0.5 * (abs(left) + abs(right))
    where = f"beyond {plain(edge, 2)} {unit} to either side"
    if left * right > 0.0:
        return f"{where} {_acts(pattern, right, 0.0, size, prediction)}"
    return f"{where} {_acts(pattern, right, 1.0, size, prediction)}"


def _largest(mean: Array, begin: int, end: int) -> float:
    part = mean[begin : end + 1]
    return float(part[int(np.argmax(np.abs(part)))])


def _one(pattern: ResidualPattern, begin: int, end: int, prediction: RunPrediction) -> str:
    size = _largest(pattern.mean, begin, end)
    centre = float(pattern.centre[begin : end + 1].mean())
    acts = _acts(pattern, size, centre, abs(size), prediction)
    return f"{_location(pattern, begin, end, prediction.units)} {acts}"


def _acts(
    pattern: ResidualPattern, size: float, side: float, amount: float, prediction: RunPrediction
) -> str:
    """Return what the measured force does that the model's does not.

    `side` is where along the coordinate; 0 for a pattern alike on both sides.
    """
    unit = prediction.unit
    up_to = f"up to {_amount(amount, prediction)}"
    more = "more" if size > 0.0 else "less"
    if unit != "N":
        return f"it is {up_to} {'higher' if size > 0.0 else 'lower'} than the model's"
    if pattern.turned:
        return f"{site_name(prediction.site or 'damper')} resists {up_to} {more} than the model"
    if side and pattern.coordinate in ("displacement", "velocity", "acceleration"):
        more = "more" if size * side > 0.0 else "less"
        verb = {"displacement": "pushes back", "velocity": "resists"}.get(
            pattern.coordinate, "resists the acceleration"
        )
        return f"it {verb} {up_to} {more} than the model"
    return f"the force is {up_to} {'higher' if size > 0.0 else 'lower'} than the model's"


def _location(pattern: ResidualPattern, begin: int, end: int, units: Mapping[str, str]) -> str:
    """Return where along a coordinate a stretch of bins lies."""
    name = pattern.coordinate
    factor, unit = shown(name, units, float(np.max(np.abs(pattern.centre))))
    low, high = factor * float(pattern.low[begin]), factor * float(pattern.high[end])
    last = len(pattern.mean) - 1
    if name == "direction":
        return "moving outwards (+x)" if pattern.centre[begin] > 0.0 else "moving back (-x)"
    if name.removesuffix("_rate") in DRIVES and name.endswith("_rate"):
        changed = "risen" if pattern.centre[end] > 0.0 else "fallen"
        return f"just after the {name.removesuffix('_rate')} has {changed}"
    if begin == 0 and end == last:
        return "throughout"
    if name == "time_since_reversal":
        if begin == 0:
            return f"in the first {plain(high, 2)} ms after the motion turns"
        return f"later than {plain(low, 2)} ms after the motion turns"
    if name == "dissipated_energy":
        if begin == 0:
            return f"before {plain(high, 2)} J are dissipated"
        return f"once {plain(low, 2)} J are dissipated"
    if (
        name in DRIVES or name not in SHOWN or name in UNITS
    ) and high - low < 0.02 * factor * float(np.ptp(pattern.centre)):
        return f"at {plain(0.5 * (low + high), 2)} {unit}"
    if begin == 0:
        return f"below {plain(high, 2)} {unit}"
    if end == last:
        return f"{'after' if name == 'time' else 'above'} {plain(low, 2)} {unit}"
    return f"between {plain(low, 2)} and {plain(high, 2)} {unit}"


def _at_levels(pattern: ResidualPattern, comparison: Comparison, finder: Finder) -> str:
    """Return whether a pattern is alike at low and high command; "" where that cannot be asked."""
    drive = comparison.drive
    if drive.name in pattern.coordinate or drive.name not in finder.bins:
        return ""
    if comparison.site not in ("", "damper"):
        return ""  # it tells how far the damper let a spring move, and nothing of the spring
    V = np.concatenate([one.judged_along()[drive.name] for one in comparison.predictions])
    middle = 0.5 * float(np.quantile(V, 0.98))
    sizes = [size_of(pattern, finder, chosen) for chosen in (middle > V, middle <= V)]
    if not all(np.isfinite([*low, *high]).all() for low, high in [sizes]):
        return ""
    (low, low_std), (high, high_std) = sizes
    doubt = 2.0 * float(np.hypot(low_std, high_std))
    if abs(high - low) <= max(_ALIKE * max(abs(low), abs(high)), doubt):
        return f", the same at every {drive.name}" if doubt < 0.7 else ""
    peak = float(np.max(np.abs(pattern.mean)))
    one = comparison.predictions[0]
    parts = (
        f"{_amount(low * peak, one)} below {plain(middle, 2)} {drive.unit}, "
        f"{_amount(high * peak, one)} above"
    )
    return f", {'more' if high > low else 'less'} at high {drive.name} ({parts})"


def size_of(
    pattern: ResidualPattern, finder: Finder, chosen: Sequence[bool] | Flags
) -> tuple[float, float]:
    """Return the size of a pattern among some samples, 1 for that of all, and its uncertainty."""
    mean, std = finder.mean_along(pattern, finder.raw, np.asarray(chosen, dtype=float))
    good = np.isfinite(mean)
    shape = pattern.mean[good]
    power = float(shape @ shape)
    if power <= 0.0 or good.sum() < 2:
        return float("nan"), float("nan")
    return float(shape @ mean[good]) / power, float(np.sqrt(shape**2 @ std[good] ** 2)) / power


def _percent(share: float) -> str:
    return f"{plain(100.0 * share, 2 if share < 0.995 else 3)} %"


def capitalised(text: str) -> str:
    """Return a text that starts with a capital."""
    return text[:1].upper() + text[1:]
