"""Sections IV-C to V: statements on the controllers, and the conditions of the runs."""

from __future__ import annotations

from .experiment import (
    BINGHAM,
    CLIPPED,
    CONTROLLERS,
    EL_CENTRO,
    FOUR,
    HINF,
    LPV,
    LPV_0,
    LPV_400,
    NONE,
)
from .numbers import (
    ALIKE,
    NOT,
    PEAK_F,
    PEAK_X,
    PEAK_Y,
    POINTS,
    REPRODUCED,
    RMS_F,
    RMS_V,
    RMS_X,
    RMS_Y,
    UNDECIDABLE,
    Key,
    Numbers,
    Verdict,
    by_record,
    listed,
    named,
    near,
    verdict_word,
)


def between(n: Numbers) -> Verdict:
    """Decide whether only the LPV controller uses voltages between the limits."""
    switch = max(n.value(case, CLIPPED, "between") for case in n.cases())
    scheduled = min(n.value(case, LPV, "between") for case in n.cases())
    return Verdict(
        verdict_word(switch == 0.0 and scheduled > 0.0),
        f"share of samples between 0 and 8 V: clipped {100 * switch:.0f} %, LPV at least "
        f"{100 * scheduled:.0f} %",
    )


def inverses(n: Numbers) -> Verdict:
    """Decide whether the LuGre inverse does better than the Bingham inverse."""

    def peak(case: Key) -> float:
        return n.lower(case, HINF, BINGHAM, PEAK_Y)

    def rms(case: Key) -> float:
        return n.lower(case, HINF, BINGHAM, RMS_Y)

    peaks, values = [peak(c) for c in n.cases()], [rms(c) for c in n.cases()]
    better = sum(value > 0.0 for value in values)
    measured = (
        f"with the LuGre inverse the RMS of y is lower in {better} of {len(values)} cases (by "
        f"{min(values):.0f} to {max(values):.0f} %), its peak in {sum(p > 0 for p in peaks)} (by "
        f"{min(peaks):.0f} to {max(peaks):.0f} %)"
    )
    share = (sum(p > 0 for p in peaks) + better) / (2 * len(values))
    verdict = REPRODUCED if share > 0.75 else NOT if share <= 0.5 else UNDECIDABLE
    return Verdict(
        verdict, measured, "The plant is a LuGre damper, which its inverse knows exactly."
    )


def roll_off(n: Numbers) -> Verdict:
    """Decide whether the weight rolls off below the first mode."""
    first, corner = n.facts["first_mode"], n.facts["weight_corner"]
    return Verdict(
        verdict_word(near(first, 13.0, 0.05) and corner < first),
        f"first mode {first:.2f} rad/s, corner of W_y {corner:g} rad/s",
        "The weight is a reconstruction that keeps to the text.",
    )


# -- section V: the comparison


def anti_windup(n: Numbers) -> Verdict:
    """Decide whether anti-windup lowers the peak acceleration and the largest command."""
    case = n.strong
    peaks = [n.value(case, law, PEAK_Y) for law in (LPV_0, LPV, LPV_400)]
    commands = [n.value(case, law, "peak command") for law in (LPV_0, LPV, LPV_400)]
    holds = all(p < peaks[0] for p in peaks[1:]) and all(c < commands[0] for c in commands[1:])
    verdict, why = (
        verdict_word(holds),
        "Where the anti-windup enters the controller is a reconstruction.",
    )
    if case[0] == EL_CENTRO:
        verdict, why = UNDECIDABLE, "No Northridge record was at hand."
    return Verdict(
        verdict,
        f"{named(case)}, λ = 0, 200, 400: peak y {peaks[0]:.2f}, {peaks[1]:.2f}, {peaks[2]:.2f} "
        f"m/s²; largest command {commands[0]:.1f}, {commands[1]:.1f}, {commands[2]:.1f} V",
        why,
    )


def _percentages(n: Numbers, law: str, weak: float, strong: float) -> Verdict:
    """Decide "so much lower than clipped" for weak and for strong earthquakes."""

    def low(case: Key) -> float:
        return n.lower(case, law, CLIPPED, PEAK_Y)

    of_weak, of_strong = [low(c) for c in n.weak()], [low(c) for c in n.strongest()]
    holds = any(abs(v - weak) <= POINTS for v in of_weak) and any(
        abs(v - strong) <= POINTS for v in of_strong
    )
    order = sum(low(case) > 0.0 for case in n.cases())
    return Verdict(
        verdict_word(holds),
        f"percent below clipped: {listed(n, low)}",
        f"Lower in {order} of {len(n.cases())} cases. The sizes depend on the weights, which are "
        "lost.",
    )  # fmt: skip


def lpv_against_clipped(n: Numbers) -> Verdict:
    """Decide whether LPV has peaks as far below clipped as stated."""
    return _percentages(n, LPV, 30.0, 25.0)


def hinf_against_clipped(n: Numbers) -> Verdict:
    """Decide whether H-infinity has peaks as far below clipped as stated."""
    return _percentages(n, HINF, 7.0, 22.0)


def lpv_against_hinf(n: Numbers) -> Verdict:
    """Decide whether the LPV controller has lower peaks than the H-infinity controller."""

    def low(case: Key) -> float:
        return n.lower(case, LPV, HINF, PEAK_Y)

    return by_record(
        n, lambda case: low(case) > 0.0, f"Percent below H-infinity, peak y: {listed(n, low)}"
    )


def drift_passive(n: Numbers) -> Verdict:
    """Decide whether no controller has a lower peak drift than 4 V."""

    def excess(case: Key) -> float:
        best = min(n.value(case, law, PEAK_X) for law in CONTROLLERS)
        return 100.0 * (n.value(case, FOUR, PEAK_X) / best - 1.0)

    return by_record(
        n,
        lambda case: excess(case) <= 0.0,
        f"4 V against the best controller, peak drift in percent: {listed(n, excess, '{:+.0f}')}",
    )


def drift_controllers(n: Numbers) -> Verdict:
    """Decide whether LPV and H-infinity have like peak drifts, and LPV the lower RMS."""

    def peak(case: Key) -> float:
        return n.lower(case, LPV, HINF, PEAK_X)

    def rms(case: Key) -> float:
        return n.lower(case, LPV, HINF, RMS_X)

    low = [rms(case) for case in n.cases()]
    alike = all(abs(peak(case)) <= 100.0 * ALIKE for case in n.cases())
    holds = alike and min(low) > 0.0 and abs(max(low) - 7.0) <= POINTS
    return Verdict(
        verdict_word(holds),
        f"LPV below H-infinity, percent: peak drift {listed(n, peak)}; RMS {listed(n, rms)}",
        ""
        if holds
        else f"Peaks {'stay' if alike else 'do not stay'} within {100 * ALIKE:g} %; "
        f"the RMS is {'lower throughout' if min(low) > 0 else 'not lower throughout'}.",
    )


def force(n: Numbers) -> Verdict:
    """Decide whether 4 V has a lower peak force and a larger RMS force than every controller."""

    def below(case: Key) -> list[float]:
        return [n.lower(case, FOUR, law, PEAK_F) for law in CONTROLLERS]

    def larger(case: Key) -> list[float]:
        return [-n.lower(case, FOUR, law, RMS_F) for law in CONTROLLERS]

    peaks = [value for case in n.cases() for value in below(case)]
    values = [value for case in n.cases() for value in larger(case)]
    return by_record(
        n,
        lambda case: min(below(case)) > 0.0 and min(larger(case)) > 0.0,
        f"Of {len(peaks)} comparisons the peak is lower in {sum(p > 0 for p in peaks)}, the RMS "
        f"larger in {sum(v > 0 for v in values)}",
        "The peak exceeds that of a controller that hardly acts.",
    )


def voltage(n: Numbers) -> Verdict:
    """Decide whether clipped has the lowest RMS voltage and the other two have like ones."""

    def ratio(case: Key) -> float:
        others = [n.value(case, law, RMS_V) for law in (HINF, LPV)]
        return n.value(case, CLIPPED, RMS_V) / min(others)

    def apart(case: Key) -> float:
        return n.value(case, LPV, RMS_V) / n.value(case, HINF, RMS_V)

    lowest = all(ratio(case) < 1.0 for case in n.cases())
    equal = all(abs(apart(case) - 1.0) <= ALIKE for case in n.cases())
    return Verdict(
        verdict_word(lowest and equal),
        f"clipped over the lower of the others: {listed(n, ratio, '{:.1f}')}; LPV over "
        f"H-infinity: {listed(n, apart, '{:.2f}')}",
        f"Clipped is {'lowest' if lowest else 'not the lowest'}; the other two are "
        f"{'' if equal else 'not '}within {100 * ALIKE:g} % of each other throughout.",
    )


def windows(n: Numbers) -> Verdict:
    """Decide whether motions, intensities and lengths of the runs are the stated ones."""
    wanted = {(EL_CENTRO, 0.2), (EL_CENTRO, 0.6)}
    north = [case for case in n.cases() if case[0] != EL_CENTRO]
    seconds = n.facts["paper_windows"]
    right = seconds.get(EL_CENTRO) == 35.0 and all(seconds[case[0]] == 20.0 for case in north)
    both = {0.3, 0.7} <= {intensity for _, intensity in north}
    if wanted <= set(n.cases()) and right and not north:
        return Verdict(
            UNDECIDABLE, "no Northridge record was at hand", "Install the records extra."
        )
    return Verdict(
        verdict_word(wanted <= set(n.cases()) and right and both),
        f"{len(n.cases())} cases; run over "
        + ", ".join(f"{name}: {value:g} s" for name, value in seconds.items()),
        "The tables' RMS values are over the records as published; those over these windows are "
        "in comparison.csv.",
    )


def without_damper(n: Numbers) -> Verdict:
    """Decide whether the building alone is linear and damped as stated."""
    per_g = [n.value(case, NONE, PEAK_Y) / case[1] for case in n.cases() if case[0] == EL_CENTRO]
    linear = max(per_g) / min(per_g) - 1.0
    ratio = n.facts["damping_ratio"]
    quiet = max(n.value(case, NONE, PEAK_F) for case in n.cases())
    return Verdict(
        verdict_word(linear < 1e-6 and near(ratio, 0.01, 0.01) and quiet == 0.0),
        f"damping ratio of the first mode {100 * ratio:.2f} %; peaks per g alike to "
        f"{linear:.0e}; {per_g[0] * 0.2:.2f} m/s² at 0.2 g",
    )
