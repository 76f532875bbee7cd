"""All numbers that decide a verdict, and what each one trades.

z is RMS(residual)/noise expected. The excess z^2 - 1 is the part of a residual's power that noise
does not account for. "Found" says how a value came about. "blind seeds": it was set by hand on
cases of the independent generator whose answer was known, on other seeds than those that are
reported. "the method": it follows from how a quantity is computed. `python -m benchmarks calibrate`
measures what a value trades. Evaluations of a search, step sizes and lengths of blocks decide
nothing by themselves and stay where they are used.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class DecisionRule:
    """What decides between none, an effect, ambiguous, unknown and insufficient.

    One instance per use: `BENCH`, `INSIDE`, `SITE`, `SENSOR`. A rule of your own is
    `dataclasses.replace(BENCH, gain=0.03)`.
    """

    # --- one effect against none

    gain: float = 0.02
    """Smallest share by which an effect, or a fault, must lower z on held-out runs to count.

    Trades: if higher, weak effects are missed; if lower, chance is named. Found: blind seeds.
    """

    chance: float = 0.01
    """Largest probability of chance at which a paired gain, or a residual's pattern, counts.

    Trades: if lower, effects that act in few blocks are missed; if higher, chance gains are named.
    Found: the method's usual level.
    """

    most_rms: float = 1.1
    """Largest plain RMS error with an effect over that without it; z weights samples differently.

    Trades: if higher, an effect that fits only the samples near rest is named; if lower, effects
    that act there are missed. Found: blind seeds.
    """

    learned: float = 0.1
    """Share of `gain` that an effect must have on the runs that it was fitted to as well, where the
    present model is `clean`.

    Where those are louder than the runs held out, it may come nearer to these by chance. Trades: if
    higher, effects are missed that act on the runs held out above all; if lower, chance is named.
    Found: the method, 10 of the log-likelihood in 5,000 samples; known effects gained `gain` there.
    """

    clean: float = 1.15
    """z of the present model above which something is missing, with or without an effect for it.

    Trades: if lower, noise that was estimated too low gives unknown; if higher, effects outside the
    library go unnoticed. Found: blind seeds, above the z of nearly all true models.
    """

    organised: float = 0.12
    """Share of a residual's power along a coordinate above which this is no accident.

    0.12 is a correlation of 0.35. Trades: if lower, accidents give unknown; if higher, effects
    outside the library go unnoticed. Found: blind seeds.
    """

    noise_overestimated: float = 0.9
    """z of the present model below which the noise was estimated too high for a verdict.

    Trades: if higher, sound data count as insufficient; if lower, effects are named against a wrong
    noise. Found: blind seeds.
    """

    likelihood: float = 40.0
    """Gain of the log-likelihood that counts as beyond chance if the model is adequate.

    Resampling of blocks does not show what happens in a few samples, such as one contact with a
    stop. Trades: if higher, rare contacts are missed; if lower, outliers count. Found: blind seeds.
    """

    # --- how well an effect must do

    adequate: float = 1.08
    """z up to which a model with an effect leaves nothing that matters.

    Trades: if higher, second effects are missed; if lower, a slightly different functional form
    asks for a second effect. Found: blind seeds.
    """

    share: float = 0.75
    """Share of the excess that an effect must explain if its model is not adequate.

    Its form may differ from that of the library: then the name is right and a residual remains.
    Trades: if higher, effects of another form give unknown; if lower, effects outside the library
    get a name. Found: blind seeds.
    """

    least_excess: float = 0.01
    """Smallest value used for z^2 - 1, because the noise is not known better.

    Trades: if higher, shares of small excesses lose their meaning; if lower, they depend on the
    estimate of the noise. Found: the method, the noise of a run of thousands of samples.
    """

    part: float = 0.5
    """Share of the error's power that an effect must explain where the noise is not known.

    The noise is in that power, so that less may be all that is missing. Trades: as `share`. Found:
    stated, a fall of the RMS error by three tenths.
    """

    # --- rivals

    close: float = 0.004
    """Share of z within which two adequate models count as equal, whatever the statistics say.

    Trades: if higher, ambiguous where one name was right; if lower, one name where the data cannot
    distinguish. Found: blind seeds.
    """

    rival: float = 1.25
    """Times the best excess up to which another effect is a rival, if the best is not adequate.

    A wrong form cannot decide between effects that are nearly as wrong. Trades: if higher,
    ambiguous where one name was right; if lower, wrong names. Found: blind seeds.
    """

    most_alternatives: int = 3
    """Largest number of effects that an ambiguous verdict names.

    Trades: if higher, the right name is one of many; if lower, it may be left out. Found: stated.
    """

    law_gain: float = 0.02
    """Share by which a law's z must exceed the best one's, beyond chance, to be clearly worse.

    Trades and found: as `gain`.
    """

    coarse: float = 3.0
    """z above which the form of a law's command is judged by the plain error.

    A law that leaves many times the noise is judged by the quietest runs, since z divides by the
    noise; the form shows where the force is large. Trades: if higher, a straight line stays where
    the force bends with the command; if lower, a parabola imitates a missing effect. Found: stated,
    and seen on published measurements.
    """

    most_laws: int = 4
    """Largest number of laws whose effects are searched.

    Up to two come on top whose error may be large because of what is missing, and the best law that
    was left out where none of these explains the runs. Trades: computing time. Found: stated.
    """

    # --- two effects

    first: float = 0.2
    """Share of the excess that the first effect of a pair must explain by itself.

    Trades: if higher, pairs that only act together are missed; if lower, more pairs are searched,
    and more found by chance. Found: blind seeds.
    """

    pair_left: float = 0.5
    """Largest excess after a second effect, as a share of the excess after the first one.

    Trades: if higher, second effects where one was hidden; if lower, second effects are missed.
    Found: blind seeds.
    """

    pair_part: float = 0.05
    """Smallest part of the first excess that the weaker effect of a pair must account for.

    Many effects can reduce the error of a wrong form. Trades: if higher, weak second effects are
    missed; if lower, a wrong form gets a second effect. Found: blind seeds.
    """

    complete: float = 1.04
    """z up to which a pair counts, whatever its weaker effect accounts for.

    This applies only if the best single effect leaves more than `clean`: no effect removes the
    error of another one's form. Trades: if higher, a wrong form gets a second effect; if lower,
    weak second effects are missed. Found: blind seeds.
    """

    rest: float = 0.03
    """Share of the first effect's excess up to which an adequate pair counts in the same way.

    Trades and found: as `complete`.
    """

    within: float = 3.0
    """Times the excess that a single effect leaves of one law, whose two effects explain the runs,
    up to which two effects of another law are searched.

    Trades: if lower, a law that two effects serve as well is missed; if higher, computing time.
    Found: stated.
    """

    # --- data that carry no verdict

    quietest: float = 3.0
    """Smallest ratio of a force to its noise that allows a verdict.

    Trades: if higher, noisy data are refused; if lower, verdicts on noise. Found: stated.
    """

    cut: float = 0.2
    """Share of samples at the limit of the force's range above which there is no verdict.

    Trades: if higher, verdicts on saturated channels; if lower, good data refused. Found: stated.
    """

    trained: float = 1.1
    """z on the training runs up to which "unknown" becomes "insufficient".

    The held-out runs then differ in something that no channel shows. Trades: if higher, missing
    effects read as insufficient data; if lower, other data read as effects. Found: blind seeds.
    """

    misfit: float = 1.15
    """z of runs above which a model does not explain them.

    It separates runs of two rigs. Trades: if higher, mixed rigs give none or unknown; if lower,
    noise reads as mixed rigs. Found: the value of `clean`.
    """

    most_groups: int = 3
    """Largest number of groups of runs, each with its own values, that count as rigs.

    Trades: if higher, changes read as rigs; if lower, three rigs give unknown. Found: stated.
    """

    # --- what the data could show, and what would tell more

    typical: float = 0.15
    """Share of the force given to an effect to test whether these data would show it.

    Trades: if higher, effects count as testable although a weak one would not be seen; if lower,
    the reverse. Found: stated, the middle strength of the blind benchmark.
    """

    silent: float = 1e-3
    """Share of the force below which the data do not excite an effect of default size.

    Trades: if higher, more effects are reported as not testable. Found: the method.
    """

    separating_sigma: float = 4.0
    """Standard deviations between rivals below which a proposed run separates them only by luck.

    Trades: if higher, useful runs are not proposed; if lower, useless ones are. Found: blind seeds.
    """

    clear: float = 0.3
    """Share of a residual's power along a coordinate above which no further check is made.

    Trades: if higher, a resonance is named instead of the coordinate; if lower, the reverse. Found:
    blind seeds.
    """

    resonance_share: float = 0.4
    """Share of a residual's power within a third of an octave, above which it is a resonance.

    Trades: the reverse of `clear`. Found: blind seeds.
    """

    pattern_share: float = 0.5
    """Share of the strongest pattern above which a significant pattern is named instead of it.

    Trades: if higher, chance patterns are named; if lower, significant patterns of little weight
    are named. Found: blind seeds.
    """

    # --- faults that channels show of each other

    fault_sigma: float = 6.0
    """Standard deviations by which a channel's fault must differ from zero.

    Trades: if higher, small faults are missed; if lower, false alarms. Found: blind seeds; the
    spread over pieces of a run is itself uncertain.
    """

    least_gain: float = 0.01
    """Smallest error of a gain that matters.

    Trades: as `fault_sigma`. Found: stated, what a laboratory knows of its instruments.
    """

    least_bias: float = 0.01
    """Smallest offset that matters, over the channel's RMS. Trades and found: as `least_gain`."""

    least_delay: float = 0.2
    """Smallest delay that matters, in sampling steps. Trades and found: as `least_gain`."""

    least_corner: float = 0.02
    """Smallest high-pass that matters, as coefficient [1/s] of the integral of displacement.

    Trades and found: as `least_gain`.
    """

    unrelated: float = 0.3
    """Share of displacement power not explained by velocity above which they are two motions.

    Trades: if higher, effects are searched in channels that do not belong together; if lower, poor
    channels are refused. Found: blind seeds.
    """

    resists: float = 0.2
    """Mean power of the force, as a share of its size, above which its sign is reliable.

    Trades: if higher, reversed channels are reported without saying which one; if lower, springs
    decide it. Found: blind seeds.
    """

    turned: float = 3.0
    """Ratio of a voltage's range below zero to that above, from which its sign is wrong.

    Trades: if higher, a reversed voltage is missed; if lower, a voltage of both signs counts as
    reversed. Found: stated.
    """

    # --- faults that only a model shows

    share_when_clean: float = 0.75
    """Smallest share explained if a fault brings z below `clean`; it is uncertain for a small z.

    Trades: if higher, faults read as effects; if lower, effects read as faults. Found: blind seeds.
    """

    margin: float = 0.02
    """Share by which an effect's loss must be below a fault's, because it has more parameters.

    Trades: if higher, effects read as faults; if lower, faults read as effects. Found: blind seeds.
    """

    promise: float = 0.3
    """Share of the loss that the screening of a fault must explain for the search to continue.

    Trades: if higher, faults are missed; if lower, more computing time. Found: blind seeds.
    """

    clocks_large: float = 2.0
    """z on the training runs from which on `clocks_promise` is asked of the clocks.

    A small excess says nothing, because one run apart hardly shows in it. Trades: if lower, clocks
    that differ are missed; if higher, more computing time. Found: the lab faults of the benchmarks.
    """

    clocks_promise: float = 0.1
    """Share of the excess that the first correction of the clocks must take to go on.

    Trades: if higher, clocks that differ are missed; if lower, more computing time. Found: the lab
    faults of the benchmarks.
    """

    late_drive_z: float = 1.3
    """z above which a drive recorded late needs no comparison with effects.

    No effect precedes its cause, and no lead explains so much by chance alone. Trades: if lower,
    effects read as faults; if higher, faults read as effects. Found: blind seeds.
    """

    # --- buildings

    building_excess: float = 0.5
    """Largest share of the excess that may remain for changed numbers of a building to be accepted.

    Trades: if higher, the numbers absorb effects; if lower, errors of the file read as effects.
    Found: blind seeds.
    """

    stiffness_known: float = 0.03
    """Standard deviation of a stiffness in a building's file, as a share.

    Trades: if higher, springs of the damper are absorbed by the file's numbers; if lower, errors of
    the file read as effects. Found: stated, what a careful laboratory reaches.
    """

    mass_known: float = 0.01
    """Standard deviation of a mass in a building's file, as a share.

    Trades and found: as `stiffness_known`.
    """

    mass_doubt: float = 0.09
    """Share by which a mass may differ from its file; a load cell's gain too, for the same reason.

    Three standard deviations of 3 %. Trades: if higher, a load cell's gain, and effects that act
    like masses, read as errors of the file; if lower, errors of the file read as faults and as
    effects. Found: stated, how well masses are known in buildings that were never weighed.
    """

    farthest: float = 2.0
    """Largest change of a number of a building's file, in standard deviations.

    Trades and found: as `stiffness_known`.
    """

    beside: float = 1.3
    """z of a building's site up to which it is told in words alone where another site has a name.

    Trades: if higher, what else is missing is not called unknown; if lower, a trace of what was
    found, or of an instrument, takes its name away. Found: blind seeds.
    """

    trace: float = 0.05
    """Share of the found effect's excess up to which another site is told in words alone, too.

    Trades and found: as `beside`.
    """

    @property
    def quiet(self) -> float:
        """z up to which no effect can lower it by `gain`: noise is all there is."""
        return 1.0 + 0.5 * self.gain

    def excess(self, z: float) -> float:
        """Return z^2 - 1, never below `least_excess`."""
        return max(z**2 - 1.0, self.least_excess)

    def explained(self, before: float, after: float) -> float:
        """Return the share of the excess that goes as z falls from one value to another."""
        return 1.0 - self.excess(after) / self.excess(before)


BENCH = DecisionRule()
"""A damper's law on a bench."""

INSIDE = replace(BENCH, organised=1.0)
"""A damper's law in a building: errors of equilibrium are correlated, so that a pattern alone, by
which the residual depends on a coordinate, accuses nothing."""

RECONSTRUCTED = replace(INSIDE, gain=0.05, rival=2.0, misfit=1.2)
"""A damper's law held against a force that equilibrium gives: what a few per cent in the building's
numbers leave of it is no finding, and no contradiction between runs. The layer's effects are tried
beside the damper's, so that a form which is wrong must stand out as it must at a site: friction of
the layer that falls with speed has the form of the damper's Stribeck effect."""

SITE = replace(BENCH, gain=0.03, share=0.7, close=0.005, rival=2.0)
"""A building's site, whose model is a line and whose noise is white and known: few effects, and
distinct ones, so that a form which is wrong must stand out more."""

SENSOR = replace(BENCH, gain=0.03, clean=1.05, share=0.9)
"""A sensor's fault: it has no other form, so it must explain nearly all."""

DRIVE = replace(SENSOR, least_delay=0.25)
"""A drive that is late on record, which only a model shows."""

LIMITED = replace(SENSOR, margin=0.003)
"""A drive that was limited in slew or range: a bend or a lag looks much like it, so that an effect
that leaves hardly less is taken instead."""
