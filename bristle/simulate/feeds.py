"""What feeds the inputs of a run, by the connections of the scenario that its results hold."""

from __future__ import annotations

import tomllib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Feed(NamedTuple):
    """The output that feeds an input, which gets factor output + offset; "" where nothing does."""

    output: str = ""
    factor: float = 1.0
    offset: float = 0.0

    @property
    def is_plain(self) -> bool:
        """Whether the input gets the output as it is."""
        return self.factor == 1.0 and self.offset == 0.0

    def given(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the input gets (n,) where the output has these values (n,)."""
        return self.factor * values + self.offset


NOTHING = Feed()
"""What feeds an input that is not connected."""


def feeds_of(scenario: str) -> dict[str, Feed]:
    """Return what feeds each input, by `component.input`.

    Parameters
    ----------
    scenario : the text of a scenario as `scenario.text` writes it
    """
    told = tomllib.loads(scenario).get("connections", {})
    return {
        target: Feed(said) if isinstance(said, str) else Feed(
            said["from"], said["factor"], said["offset"]
        )
        for target, said in told.items()
    }  # fmt: skip
