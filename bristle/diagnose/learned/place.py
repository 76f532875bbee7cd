"""Where a curve acts: in a damper, in the isolation layer of a building, or in one of its storeys.

The model of a layer or a storey is a line. What an effect is offered there differs in name: a
storey's motion is its drift, and its force is asked for by another hook.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ...compare.names import OF_STOREY
from ...identify.rig import DAMPER

_SIGNALS = {"x": "drift", "v": "drift_rate"}
"""Signals of a layer, and what a storey calls them."""

_OFFERED = {*_SIGNALS, "dt"}
"""What a curve along a line may depend on, beside what is known of the line itself."""

_READ = re.compile(rf"\bq\.({'|'.join(_SIGNALS)})\b")


@dataclass(frozen=True)
class Place:
    """A site of a rig, by its name: "damper", "layer", "storey1", "storey2" ..."""

    name: str = DAMPER

    @property
    def is_line(self) -> bool:
        """Whether the model there is a line, k x + c v with a constant, not a damper's law."""
        return self.name != DAMPER

    @property
    def storey(self) -> int:
        """The storey's number, 0 elsewhere."""
        return int(self.name.removeprefix("storey")) if self._of_storey else 0

    @property
    def site(self) -> str:
        """The site that an effect there declares."""
        return "structure" if self.is_line else DAMPER

    @property
    def _of_storey(self) -> bool:
        return self.name.startswith("storey")

    def offers(self, needs: tuple[str, ...]) -> bool:
        """Return whether a hook there has these signals, by their names in a damper."""
        return not self.is_line or set(needs) <= _OFFERED

    def hook(self, name: str) -> str:
        """Return what the hook of a damper that adds a force is called there."""
        return "spring" if self._of_storey and name == "force" else name

    def needs(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Return what signals are called there."""
        return tuple(_SIGNALS.get(one, one) for one in names) if self._of_storey else names

    def source(self, text: str) -> str:
        """Return the source of a hook with the signals as they are called there."""
        if not self._of_storey:
            return text
        return _READ.sub(lambda found: f"q.{_SIGNALS[found[1]]}", text)

    def words(self, text: str) -> str:
        """Return the words for a signal as they are there: the displacement of a storey is drift.

        Parameters
        ----------
        text : a few words, in each of which one signal is named at the most
        """
        if not self._of_storey:
            return text
        return " ".join(OF_STOREY.get(word, word) for word in text.split(" "))


AT_DAMPER = Place()
"""The damper, on a bench or in a building."""
