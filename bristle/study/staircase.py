"""The staircase of a study's history, for the terminal: the error of each model, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log10, sqrt
from typing import TYPE_CHECKING, Any

from ..quantity import percent, plain, quantity, short_z

if TYPE_CHECKING:
    from rich.text import Text

    from .history import Step

WIDTH = 40
"""Characters of the longest bar."""
NAME = 40
"""Characters of the longest step's name."""
CLOSE = 1.1
"""z up to which an error is drawn as being on the noise floor."""


@dataclass(frozen=True)
class HistoryStep:
    """One step of the staircase: what was done, and z and error [N] of the model after it.

    `share` is the error on held-out runs over the force's RMS [1]. A step of a version that knew
    the low-passed error alone has that one: `cut_off` [Hz] of its low-pass is then not 0, or None
    where the step does not tell it.
    """

    number: int
    what: str
    z: float | None
    z_train: float | None
    rms: float | None
    share: float | None = None
    cut_off: float | None = None

    @property
    def missed(self) -> float:
        """The share of the force that the model misses beyond noise; 0 where noise is all."""
        if self.z is None or self.share is None or self.z <= CLOSE:
            return 0.0
        return self.share * sqrt(1.0 - 1.0 / self.z**2)


@dataclass(frozen=True)
class Staircase:
    """The steps of a history; `str` gives plain text, rich prints it in colour.

    `floor` is the z that noise alone explains; `cut_off` [Hz] of the low-pass on the forces whose
    RMS errors are told where a step does not tell, 0 for none.
    """

    history_steps: tuple[HistoryStep, ...]
    floor: float = 1.0
    unit: str = "N"
    cut_off: float = 0.0

    def __str__(self) -> str:
        return "\n".join("".join(text for text, _ in line).rstrip() for line in self._lines("#"))

    def __rich__(self) -> Text:
        from rich.text import Text

        lines = [Text.assemble(*parts) for parts in self._lines("█")]
        return Text("\n").join(lines)

    def _lines(self, mark: str) -> list[list[tuple[str, str]]]:
        """Return the lines as pairs of text and style."""
        if not self.history_steps:
            return [[("The history is empty.", "")]]
        names = [_cut(f"{one.number} {one.what}") for one in self.history_steps]
        wide = max(len(name) for name in [*names, "  noise floor"])
        known = [one.z for one in self.history_steps if one.z is not None]
        top = max([*known, 2.0 * self.floor])
        title = "error / noise (z) on held-out runs"
        lines = [[(f"{'':{wide}}  {title}", "dim")]]
        for name, one in zip(names, self.history_steps, strict=True):
            lines.append([(f"{name:{wide}}  ", "bold"), *self._line(one, top, mark)])
        lines.append([(f"{'  noise floor':{wide}}  ", "dim"), (f"| {plain(self.floor)}", "green")])
        return lines

    def _size(self) -> float:
        return max((one.rms for one in self.history_steps if one.rms is not None), default=0.0)

    def _line(self, one: HistoryStep, top: float, mark: str) -> list[tuple[str, str]]:
        if one.z is None:
            if one.share is None:
                return [("not judged", "dim")]
            return [(f"z not known, {100.0 * one.share:.1f} % of the force is missed", "dim")]
        done = one.z <= CLOSE * self.floor
        share = log10(max(one.z / self.floor, 1.0)) / log10(top / self.floor)
        bar = mark * max(1, round(WIDTH * share))
        colour = "green" if done else "dark_orange"
        cut_off = self.cut_off if one.cut_off is None else one.cut_off
        low = f" below {cut_off:g} Hz" if cut_off else ""
        of_force = f" ({percent(one.share)})" if one.share is not None else ""
        size = f"{quantity(one.rms or 0.0, self.unit, 4, self._size())}{of_force}{low}"
        about = [] if one.rms is None else [f"error {size}"]
        about += [] if one.z_train is None else [f"training z = {short_z(one.z_train)}"]
        tail = f"   {', '.join(about)}" if about else ""
        return [(bar, colour), (f" {short_z(one.z)}", f"bold {colour}"), (tail, "dim")]


def staircase(steps: Sequence[Step], noise_floor: float = 1.0, cut_off: float = 0.0) -> Staircase:
    """Return the staircase of a history, to print as it is or to show live.

    Parameters
    ----------
    steps : list of Step
        Their `after` holds "z_holdout", "z_train", "error_holdout" [N]; a step without is "not
        judged", unless the next one's `before` holds them. Of steps with a low-passed error
        alone, "rms_holdout", the staircase says so.
    noise_floor : float
        z that noise alone explains.
    cut_off : float
        Hz, of the low-pass behind a step's "rms_holdout" where the step does not tell it; 0 for
        none.

    Examples
    --------
    >>> from bristle.study import Step
    >>> print(staircase([Step(0, "identify", "", {}, {"z_holdout": 4.0})]))
                   error / noise (z) on held-out runs
    0 identify     ######################################## 4.00
      noise floor  | 1
    """
    return Staircase(tuple(history_steps(steps)), noise_floor, cut_off=cut_off)


def history_steps(steps: Sequence[Step]) -> list[HistoryStep]:
    """Return the steps of a history: what each step's `after` says, or the next one's `before`."""
    out = []
    for k, step in enumerate(steps):
        errors: dict[str, Any] = {**step.after}
        if not errors and k + 1 < len(steps):
            errors = {**steps[k + 1].before}
        new = "error_holdout" in errors
        names = (
            ("error_holdout", "error_share_holdout") if new else ("rms_holdout", "share_holdout")
        )
        keys = ("z_holdout", "z_train", *names)
        z, z_train, rms, share = (_number(errors.get(key)) for key in keys)
        low = 0.0 if new else _number(errors.get("cut_off"))
        out.append(HistoryStep(step.number, step.what, z, z_train, rms, share, low))
    return out


def _cut(name: str) -> str:
    """Return a step's name, no longer than `NAME`."""
    return name if len(name) <= NAME else f"{name[: NAME - 3]}..."


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and value == value else None
