"""The numbers that decide which curve is learned and how it is called, and what each one trades."""

from __future__ import annotations

from dataclasses import dataclass

from .curve import Curve
from .signals import GIVEN


@dataclass(frozen=True)
class LearnRule:
    """What decides between curves; whether one is kept is decided by a `DecisionRule`."""

    near: float = 1.25
    """Largest mean squared residual that a curve promises, over that of the best one, to be tried.

    Trades: if higher, curves of no promise are fitted, which takes time; if lower, the curve that
    is right is missed where the linear model of the scan is a poor one. Found: blind seeds.
    """

    memory: float = 1.02
    """What each time or travel of a memory must lower the mean squared residual by, as a factor.

    Trades: if higher, memories are missed; if lower, a short memory stands for a plain signal.
    Found: blind seeds.
    """

    direction: float = 1.25
    """The same of a curve for each direction, which has twice the values.

    Trades: if higher, a force that differs on the way out and back is missed; if lower, two curves
    without a name stand for one that has a name. Found: blind seeds.
    """

    surface: float = 1.25
    """The same of a surface over two signals, which has the values of several curves.

    Trades: if higher, what depends on two signals at once is missed; if lower, a surface without a
    name stands for a curve that has one. Found: blind seeds.
    """

    enough: float = 0.92
    """Share of the excess z^2 - 1 from which on a curve is not compared with surfaces.

    A second curve usually explains what it leaves. Trades: if higher, surfaces without a name
    stand for two curves that have one; if lower, what depends on two signals at once is missed.
    Found: blind seeds.
    """

    coarse: float = 1.03
    """z on training runs above which a curve is tried with twice the knots.

    Trades: if higher, a steep curve keeps its error; if lower, curves are fitted for nothing, which
    takes time. Found: stated; noise moves z by a hundredth.
    """

    finer: float = 0.98
    """Largest mean squared residual with twice the knots, over that with as many as there are.

    It is that of stretches which a step of the fit left out. Trades: if higher, tables are long for
    nothing; if lower, a steep curve stays coarse. Found: stated.
    """

    worth: float = 0.1
    """Smallest share of the excess z^2 - 1 that a curve must explain to be kept.

    Trades: if higher, a rig with several unknowns keeps its error although each curve lowers it; if
    lower, curves that say little. Found: stated; that a gain is no chance is tested besides.
    """

    as_good: float = 1.03
    """Largest error on training runs of a closed form over that of the curve which it replaces.

    Trades: if higher, formulas stand where they only resemble the curve; if lower, tables stay
    where a formula is right. Found: blind seeds.
    """

    unsteady: float = 1.5
    """Times its mean squared residual that a model may have on a stretch which a fit left out.

    Beyond it the model's parameters are held for the scan. Trades: if higher, a scan says nothing
    where the runs hardly tell parameters apart; if lower, a curve that the parameters have absorbed
    in part is missed. Found: stated, and seen on published measurements.
    """

    follows: float = 0.12
    """Largest share of a curve's variation that a closed form may leave to be the curve's name.

    Trades: if higher, wrong names; if lower, curves without a name. Found: blind seeds.
    """

    resembles: float = 0.35
    """Largest such share at which a closed form may still take a curve's place.

    Beyond `follows` it must do better than the curve on the training runs: with fewer numbers it
    only does so if the table between its knots, or a second look, was what fell short. Trades: if
    higher, fits of forms that have no promise; if lower, ripples that knots hardly resolve keep
    their table. Found: blind seeds.
    """

    near_form: float = 0.5
    """Largest such share at which a form that is no name is told and drawn as the nearest.

    Trades: if higher, a constant stands beside a bell; if lower, a hint is lost. Found: stated.
    """

    def weighed(self, loss: float, curve: Curve) -> float:
        """Return a mean squared residual, raised by what a curve must pay for what it has more.

        Parameters
        ----------
        loss : where the curve was not fitted
        curve : along a memory, in each direction, over two signals
        """
        for name, _ in curve.memory:
            loss *= self.direction if name in GIVEN else self.memory
        return loss * self.surface if curve.across else loss


LEARN = LearnRule()
"""A damper, on a bench or in a building."""
