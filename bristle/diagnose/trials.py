"""The trials of effects at the damper: single ones, and pairs as far as they are asked for."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

from ..compare.patterns import ResidualPattern
from ..identify.search_context import refine
from ..identify.structure import StructureProblem
from ..identify.threads import in_threads
from .candidates import SECONDS, Trial, judge, try_all, try_members
from .opening import Opening, Progress, of_layer, silent
from .remaining_residual import patterns_of
from .sites import try_effect

CONTENDERS, NEAR = 3, 1.03
"""How many trials at most are fitted to all that was recorded, and up to which z as a multiple of
the best one's: rivals are told apart on equal terms."""


class Trials:
    """The trials of single effects, and of `pairs` as far as they are asked for.

    Parameters
    ----------
    opened : the runs and the present model
    say : is told what is being done
    earlier : the same trials by other weights, whose ends are where these begin
    """

    def __init__(
        self, opened: Opening, say: Progress = silent, earlier: Trials | None = None
    ) -> None:
        self.opened, self.say = opened, say
        self.before = opened.before
        self.pairs: list[Trial] = []
        self._found: dict[tuple[str, ...], list[Trial]] = {}
        self._earlier = earlier._found if earlier else {}
        self._weighed: dict[float, Trials] = {}
        say("trying every effect inside the model")
        self.single = self._all(self.before, None)

    @property
    def best(self) -> Trial:
        """The trial that leaves least, the present model among them."""
        return min((self.before, *self.single, *self.pairs), key=lambda trial: trial.z)

    def with_excess(self, excess: float) -> Trials:
        """Return the trials fitted and judged anew; see `Opening.with_excess`."""
        if excess not in self._weighed:
            opened = self.opened.with_excess(excess)
            before = refine(self.before.model, opened.problem)
            opened = replace(opened, before=judge(before, opened.problem, opened.held_out))
            self._weighed[excess] = Trials(opened, self.say, self)
        return self._weighed[excess]

    @cached_property
    def patterns(self) -> list[ResidualPattern]:
        """Along which coordinates the present model's residual is organised."""
        return patterns_of(self.before, self.opened.held_out)

    def grow(self, first: Trial) -> list[Trial]:
        """Return the trials of all effects added to a trial's model."""
        self.say(f"no single effect suffices: adding a second one to {first.effects[-1]}")
        grown = self._all(first, SECONDS)
        self.pairs += grown
        return grown

    def reduce(self, pair: Trial) -> list[Trial]:
        """Return the trials of a pair's members alone."""
        return try_members(pair, self.before.model, self.opened.problem, self.opened.held_out)

    def _all(self, first: Trial, most: int | None) -> list[Trial]:
        if first.effects in self._found:
            return [*self._found[first.effects]]
        opened = self.opened
        held_out = opened.held_out
        if first.effects in self._earlier:
            trials = in_threads(self._again, self._earlier[first.effects])
        else:
            trials = try_all(first.model, opened.searched, held_out, shown=opened.shown, most=most)
            trials = [*trials, *self._of_layer(first)]
        trials.sort(key=lambda trial: trial.z)
        if opened.searched is not opened.problem:
            best = trials[0].z
            for k, one in enumerate(trials[:CONTENDERS]):
                if one.refined and one.z <= NEAR * best:
                    trials[k] = judge(refine(one.model, opened.problem), opened.problem, held_out)
        self._found[first.effects] = sorted(trials, key=lambda trial: trial.z)
        return [*self._found[first.effects]]

    def _again(self, trial: Trial) -> Trial:
        """Return a trial fitted and judged by these runs' weights, from where it ended before."""
        train, held_out = self.opened.searched, self.opened.held_out
        model = refine(trial.model, train) if trial.refined else trial.model
        return replace(judge(model, train, held_out), refined=trial.refined)

    def _of_layer(self, first: Trial) -> list[Trial]:
        """Return the trials of the layer's effects, of which a reconstructed force has a share."""
        problem, held_out = self.opened.problem, self.opened.held_out
        if not (isinstance(problem, StructureProblem) and isinstance(held_out, StructureProblem)):
            return []
        names = of_layer(first.model, problem)
        return [try_effect(name, first.model, problem, held_out) for name in names]
