"""The numbers that decide a verdict, all of them, with what each one trades.

z is RMS(residual)/noise expected, the excess z^2 - 1 the part of a residual's power that noise does
not account for. "Found" says how a value came about: "blind seeds" are cases of the independent
generator whose truth was looked at while values were set by hand, on other seeds than those that
are reported; "the method" is what follows from how a quantity is made. What a value trades is
measured by `python -m benchmarks calibrate`.

How many evaluations a search takes, step sizes and lengths of blocks decide nothing by themselves:
they stay where they are used.
"""

# Longer than 300 lines: one number after the other, each with its reason.

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
    """Smallest share by which an effect, or a fault, must lower z on held-out runs to be missing.

    Trades: above, weak effects are missed; below, chance is named. Found: blind seeds.
    """

    chance: float = 0.01
    """Probability of chance at which a paired gain, or a residual's pattern, still counts.

    Trades: below, effects that act in few blocks are missed; above, chance is named. Found: the
    method's usual level.
    """

    most_rms: float = 1.1
    """What an effect may leave of the plain RMS error, as a multiple: its weights are not z's.

    Trades: above, what serves only the samples near rest is named; below, effects that act there
    are missed. Found: blind seeds.
    """

    clean: float = 1.15
    """z of the present model above which something is missing, whether an effect tells it or not.

    Trades: below, noise that was estimated too low reads as unknown; above, what no effect
    describes goes unseen. Found: blind seeds, above the z of nearly all true models.
    """

    organised: float = 0.12
    """Share of a residual's power along a coordinate (a correlation of 0.35) that is no accident.

    Trades: below, accidents read as unknown; above, what no effect describes goes unseen. Found:
    blind seeds.
    """

    loud: float = 0.9
    """z of the present model below which the noise was estimated too high to judge by it.

    Trades: above, sound data count as insufficient; below, effects are named against a wrong noise.
    Found: blind seeds.
    """

    likelihood: float = 40.0
    """Gain of the log-likelihood that counts as beyond chance where the model is adequate.

    What happens in a few samples, such as a stop that is met once, is seen in no resampling of
    blocks. Trades: above, rare contacts are missed; below, outliers are named. Found: blind seeds.
    """

    # --- how well an effect must do

    adequate: float = 1.08
    """z up to which a model with an effect leaves nothing that matters.

    Trades: above, second effects are missed; below, forms that differ a little from ours ask for a
    second effect. Found: blind seeds.
    """

    share: float = 0.75
    """Share of the excess that an effect must explain where its model is not adequate.

    Its form may differ from ours: then the name is right and a residual remains. Trades: above,
    effects of another form read as unknown; below, what no effect describes gets a name. Found:
    blind seeds.
    """

    least_excess: float = 0.01
    """Floor of z^2 - 1: the noise is not known better.

    Trades: above, shares of small excesses are blunted; below, they hang on the estimate of the
    noise. Found: the method, the noise of a run of thousands of samples.
    """

    # --- rivals

    close: float = 0.004
    """Share of z within which two adequate models are equal, whatever the statistics say.

    Trades: above, ambiguous where one name was right; below, one name where the data cannot
    distinguish. Found: blind seeds.
    """

    rival: float = 1.25
    """Times the best excess up to which another one rivals it, where the best is not adequate.

    A misfit of form cannot decide between what is nearly as wrong. Trades: above, ambiguous where
    one name was right; below, wrong names. Found: blind seeds.
    """

    most_alternatives: int = 3
    """Most effects that an ambiguous verdict names.

    Trades: above, the name is among many; below, it may be left out. Found: stated.
    """

    # --- two effects

    first: float = 0.2
    """Share of the excess that the first effect of a pair must explain by itself.

    Trades: above, pairs that act together are missed; below, more pairs are searched, by chance
    too. Found: blind seeds.
    """

    pair_left: float = 0.5
    """What a second effect may leave, as a share of the excess that the first one leaves.

    Trades: above, second effects where one was hidden; below, second effects are missed. Found:
    blind seeds.
    """

    pair_part: float = 0.05
    """Smallest part of the first excess that the lesser effect of a pair must account for.

    A misfit of form is lowered by many effects. Trades: above, small second effects are missed;
    below, misfits of form get one. Found: blind seeds.
    """

    complete: float = 1.04
    """z up to which a pair counts whatever its lesser effect accounts for.

    Only where the best single effect leaves more than `clean`: no effect closes the misfit of
    another one's form. Trades: above, misfits of form get a second effect; below, small second
    effects are missed. Found: blind seeds.
    """

    rest: float = 0.03
    """Share of what the first effect leaves that may remain for the same where a pair is adequate.

    Trades and found: as `complete`.
    """

    # --- data that carry no verdict

    quietest: float = 3.0
    """By what factor a force must exceed its noise for a verdict to mean anything.

    Trades: above, noisy data are refused; below, verdicts on noise. Found: stated.
    """

    cut: float = 0.2
    """Share of samples at the end of the force's range from which on nothing is judged.

    Trades: above, verdicts on what was cut; below, usable data are refused. Found: stated.
    """

    trained: float = 1.1
    """z on the training runs up to which "unknown" becomes "insufficient".

    The held-out runs then differ in something that no channel shows. Trades: above, missing effects
    read as insufficient data; below, data that differ read as missing effects. Found: blind seeds.
    """

    misfit: float = 1.15
    """z of runs above which a model has not explained them: runs of two rigs are told by it.

    Trades: above, mixed rigs read as none or unknown; below, noise reads as mixed rigs. Found: the
    value of `clean`.
    """

    most_groups: int = 3
    """Most groups of runs, each with values of its own, that are taken for rigs.

    Trades: above, what changes from run to run reads as rigs; below, three rigs read as unknown.
    Found: stated.
    """

    # --- what the data could show, and what would tell more

    typical: float = 0.15
    """Share of the force that an effect is given to ask whether these data would show it.

    Trades: above, effects count as testable that a weak one would not be; below, the reverse.
    Found: stated, the middle strength of the blind benchmark.
    """

    silent: float = 1e-3
    """Share of the force below which an effect of default size is not excited at all.

    Trades: above, more effects are told to be untestable. Found: the method.
    """

    tells: float = 4.0
    """Standard deviations between rivals below which a proposed run tells them apart by luck.

    Trades: above, runs that would tell are not proposed; below, runs are proposed in vain. Found:
    blind seeds.
    """

    clear: float = 0.3
    """Share of a residual's power along a coordinate that needs no second look.

    Trades: above, a resonance is named in place of the coordinate; below, the reverse. Found: blind
    seeds.
    """

    rings: float = 0.4
    """Share of a residual's power within a third of an octave that is a resonance.

    Trades: as `clear`, the other way. Found: blind seeds.
    """

    half: float = 0.5
    """Share of the strongest pattern from which on a significant one is named before it.

    Trades: above, patterns by chance are named; below, significant ones that carry little. Found:
    blind seeds.
    """

    # --- faults that channels show of each other

    sure: float = 6.0
    """Standard deviations that a fault of a channel must be away from none.

    Trades: above, small faults are missed; below, false alarms. Found: blind seeds; the spread over
    pieces of a run is itself uncertain.
    """

    least_gain: float = 0.01
    """Smallest error of a gain that matters.

    Trades: as `sure`. Found: stated, what a laboratory knows of its instruments.
    """

    least_bias: float = 0.01
    """Smallest offset that matters, by the channel's RMS. Trades and found: as `least_gain`."""

    least_delay: float = 0.2
    """Smallest delay that matters, in sampling steps. Trades and found: as `least_gain`."""

    least_corner: float = 0.02
    """Smallest high-pass that matters, as the coefficient [1/s] of the integral of displacement.

    Trades and found: as `least_gain`.
    """

    unrelated: float = 0.3
    """Share of the displacement's power unexplained by the velocity: they are two motions.

    Trades: above, effects are sought in channels that do not belong together; below, poor channels
    are refused. Found: blind seeds.
    """

    resists: float = 0.2
    """Mean power of the force, as a share of its size, that tells which way is forward.

    Trades: above, turned channels are told without saying which; below, springs decide it. Found:
    blind seeds.
    """

    turned: float = 3.0
    """By what factor a voltage must reach further below zero than above to be turned.

    Trades: above, a turned voltage is missed; below, one that swings both ways counts as turned.
    Found: stated.
    """

    longest: int = 5
    """Samples in a row at the very same extreme that no noisy signal shows.

    Trades: above, channels that were cut briefly pass; below, coarse instruments count as cut.
    Found: blind seeds and published measurements.
    """

    crowded: float = 8.0
    """How many times more samples stand at a cut than at a step of a coarse instrument below it.

    Trades and found: as `longest`.
    """

    # --- faults that only a model shows

    share_when_clean: float = 0.75
    """Least part explained where a fault brings z below `clean`: of a small z it is uncertain.

    Trades: above, small faults read as effects; below, effects read as faults. Found: blind seeds.
    """

    margin: float = 0.02
    """Share by which an effect's loss must be below that of a fault: its parameters are more.

    Trades: above, effects read as faults; below, faults as effects. Found: blind seeds.
    """

    promise: float = 0.3
    """Part of the loss that a first look at a fault must explain for a search to go on.

    Trades: above, faults are missed; below, time. Found: blind seeds.
    """

    plain: float = 1.3
    """z above which a late record of the drive needs no comparison with effects.

    No effect precedes its cause, and by chance alone no lead explains so much. Trades: below,
    effects read as faults; above, faults as effects. Found: blind seeds.
    """

    # --- buildings

    moved: float = 0.5
    """What moved numbers of a building may leave of the excess, as a share, to be taken.

    Trades: above, numbers follow what an effect does; below, errors of the file read as effects.
    Found: blind seeds.
    """

    stiffness_known: float = 0.03
    """Standard deviation of a stiffness in a building's file, as a share.

    Trades: above, springs of the damper hide in the file; below, errors of the file read as
    effects. Found: stated, what a careful laboratory reaches.
    """

    mass_known: float = 0.01
    """The same of a mass. Trades and found: as `stiffness_known`."""

    mass_doubt: float = 0.09
    """Share by which a mass may differ from its file, and a load cell's gain for the same reason.

    Three standard deviations of 3 %. Trades: above, gains of the load cell and effects that act
    like masses are taken for the file's; below, errors of the file read as faults and as effects.
    Found: stated, what buildings are known to that were never weighed.
    """

    farthest: float = 2.0
    """Standard deviations by which a file's numbers may move. Trades and found: as they."""

    blurred: float = 1.25
    """z that a true sign law may read where the base's velocity had to be left out.

    Its jumps are then told by displacement and accelerometer alone. Trades: above, missing effects
    are excused; below, an instrument reads as unknown. Found: blind seeds.
    """

    @property
    def quiet(self) -> float:
        """z up to which no effect can lower it by `gain`: noise is all there is."""
        return 1.0 + 0.5 * self.gain

    def excess(self, z: float) -> float:
        """Return z^2 - 1, never below `least_excess`."""
        return max(z**2 - 1.0, self.least_excess)


BENCH = DecisionRule()
"""A damper's law on a bench."""

INSIDE = replace(BENCH, organised=1.0)
"""A damper's law in a building: errors of equilibrium are correlated, so that a pattern alone, by
which the residual depends on a coordinate, accuses nothing."""

SITE = replace(BENCH, gain=0.03, share=0.7, close=0.005, rival=2.0)
"""A building's site, whose model is a line and whose noise is white and known: few effects, and
distinct ones, so that a form which is wrong must stand out more."""

SENSOR = replace(BENCH, gain=0.03, clean=1.05, share=0.9)
"""A sensor's fault: it has no other form, so it must explain nearly all."""

DRIVE = replace(SENSOR, least_delay=0.25)
"""A drive that is late on record, which only a model shows."""
