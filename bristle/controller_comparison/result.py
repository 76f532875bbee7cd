"""What a comparison of controllers came to: its tables, and what they say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..campaign.campaign import Output
from ..errors import not_usable
from ..view import Viewable
from .limits import Reached
from .runs import Bench
from .setting import BEST, LIMIT, OFF, ON, Damper, Entry, Motion, Site
from .worst_case import Spread

if TYPE_CHECKING:
    import pandas as pd


REFERENCES = (OFF, ON, BEST)


@dataclass(frozen=True)
class Setting:
    """What was compared: building, damper, controllers, motions, what is judged.

    `folder` holds the scenarios, None where nothing was kept; `varied` says in words how members
    differ, "" without.
    """

    site: Site
    damper: Damper
    entries: list[Entry]
    motions: list[Motion]
    judged: Output
    spread: Spread | None
    folder: Path | None
    varied: str = ""


@dataclass(frozen=True, repr=False)
class ControllerComparison(Viewable):
    """Controllers under ground motions, beside constant voltages.

    Attributes
    ----------
    setting : Setting
        What was compared.
    outputs : tuple of Output
        What is kept of every run.
    table : DataFrame
        A row per motion and controller: motion, controller, engine, level (of a constant voltage
        [V]), stroke (largest displacement over the damper's stroke [1]), and a column per output,
        "peak structure.drift1", in SI units (`units`).
    worst : DataFrame or None
        Likewise the largest over each case and its members, and how many members failed.
    levels : mapping
        By motion: the same outputs at constant voltages, by the voltage [V].
    limits : mapping
        By motion what is known of its limit; empty where it was not asked for.
    frames : mapping
        By motion and controller the run, by time [s].
    notes : tuple of str
        What a reader has to know.
    seconds : float
    """

    setting: Setting
    outputs: tuple[Output, ...]
    table: pd.DataFrame
    worst: pd.DataFrame | None
    levels: Mapping[str, pd.DataFrame] = field(repr=False)
    limits: Mapping[str, Reached]
    frames: Mapping[tuple[str, str], pd.DataFrame] = field(repr=False)
    notes: tuple[str, ...]
    seconds: float

    @property
    def motions(self) -> list[str]:
        """The names of the motions."""
        return [one.name for one in self.setting.motions]

    @property
    def controllers(self) -> list[str]:
        """The names of the controllers, as they were given."""
        return [one.name for one in self.setting.entries]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each output by its name."""
        return {one.name: one.unit for one in self.outputs}

    @property
    def verdict(self) -> list[str]:
        """What the comparison says, a sentence each, the first one first."""
        from .words import sentences

        return sentences(self)

    def value(self, motion: str, controller: str, output: str = "") -> float:
        """Return what a case has of an output; else of the one that is judged."""
        rows = self.table
        row = rows[(rows["motion"] == motion) & (rows["controller"] == controller)]
        return float(row[output or self.setting.judged.name].iloc[0])

    def worst_value(self, motion: str, controller: str) -> float:
        """Return the worst of what is judged of a case; NaN without members."""
        if self.worst is None or controller == LIMIT:
            return float("nan")
        rows = self.worst
        row = rows[(rows["motion"] == motion) & (rows["controller"] == controller)]
        return float(row[self.setting.judged.name].iloc[0])

    def shares(self, reference: str = BEST) -> pd.DataFrame:
        """Return what is judged over that of a reference, by motion (rows) and controller.

        Parameters
        ----------
        reference : "passive off", "passive on" or "best constant"
        """
        name = self.setting.judged.name
        wide = self.table.pivot(index="motion", columns="controller", values=name)
        order = list(dict.fromkeys(self.table["controller"]))
        return wide.loc[self.motions, order].div(wide[reference].loc[self.motions], axis=0)

    def quantities(self) -> pd.DataFrame:
        """Return a row per motion, controller and output.

        Columns motion, controller, output, unit, value, worst (NaN without members), and the value
        over that of each reference: "over passive off" ...
        """
        import pandas as pd

        worsts: dict[tuple[str, str], Any] = {}
        if self.worst is not None:
            worsts = {(row["motion"], row["controller"]): row
                      for row in self.worst.to_dict(orient="records")}  # fmt: skip
        cases = {(row["motion"], row["controller"]): row
                 for row in self.table.to_dict(orient="records")}  # fmt: skip
        rows = []
        for (motion, controller), case in cases.items():
            worst = worsts.get((motion, controller), {})
            for one in self.outputs:
                row = {
                    "motion": motion, "controller": controller, "output": one.name,
                    "unit": one.unit, "value": case[one.name],
                    "worst": worst.get(one.name, float("nan")),
                }  # fmt: skip
                for reference in REFERENCES:
                    other = cases[motion, reference][one.name]
                    row[f"over {reference}"] = case[one.name] / other if other else float("nan")
                rows.append(row)
        return pd.DataFrame(rows)

    def write(self, folder: str | Path) -> list[Path]:
        """Write the tables as CSV: comparison.csv and quantities.csv; return their paths.

        Raises
        ------
        RunError
            If they cannot be written, exit code 2.
        """
        folder = Path(folder)
        titles = {n: f"{n} [{u}]" for n, u in {**self.units, "level": "V", "stroke": "1"}.items()}
        frames = {
            "comparison.csv": self.table.rename(columns=titles),
            "quantities.csv": self.quantities(),
        }
        if self.worst is not None:
            frames["worst.csv"] = self.worst.rename(columns=titles)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for name, frame in frames.items():
                frame.to_csv(folder / name, index=False, float_format="%.9g")
        except OSError as error:
            raise not_usable(f"{folder}: cannot be written: {error.strerror or error}.") from error
        return [folder / name for name in frames]


# What a reader of a comparison has to know of it, in sentences.


def of_designs(entries: list[Entry]) -> list[str]:
    """Say which designs were made by the comparison, and why."""
    anew = [one.name for one in entries if one.anew]
    if not anew:
        return []
    return [
        f"{', '.join(anew)}: the library's designs belong to its own building and damper. New ones "
        "were made for these, with the same weights brought to their size; a design file with "
        "weights of your own may find better ones (bristle design)."
    ]


def of_engines(bench: Bench, entries: list[Entry]) -> list[str]:
    """Say where two engines stand side by side."""
    stepped = [one.name for one in entries if bench.engine_of(one) == "fmu"]
    if not stepped or len(stepped) == len(entries):
        return []
    return [
        f"{', '.join(stepped)}: stepped as FMUs every {1e3 * bench.step:g} ms. The others are "
        "solved as one system, without coupling error; the engine fmu steps all of them."
    ]
