"""The ground motions of a comparison: stock names, or files with their scale."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, isfinite
from pathlib import Path

from ..batch.passive import G
from ..data import list_ground_motions, read_ground_motion
from ..errors import ScenarioError
from ..findings import unknown, written
from .choice import Choice, Value, choices_of, refuse_twice
from .folder import Folder, Part, plain_name

_IN_G = re.compile(r"([-+.\deE]+)\s*g")
_KEYS = ("peak", "factor", "start", "stop")


@dataclass(frozen=True)
class Motion:
    """A ground motion as it shakes the building.

    Attributes
    ----------
    name : str
        In tables.
    part : Part
        The GroundMotion of its scenarios.
    stop : float
        End of the runs [s].
    peak : float
        Largest acceleration as it is run [m/s2].
    source : str
        Where the numbers come from, in words.
    """

    name: str
    part: Part
    stop: float
    peak: float
    source: str


def motions_of(given: Sequence[str | Path], folder: Folder, step: float) -> list[Motion]:
    """Return the ground motions, their files kept in the comparison's folder.

    Parameters
    ----------
    given : `RECORD,peak=0.6g,factor=0.45,stop=30`; the record a name, its beginning, or a file
    folder : of the comparison
    step : of the runs [s]; they end with the record, or at `stop`, on a whole number of steps

    Raises
    ------
    ScenarioError, RecordError
        If there is none, one is given twice, or a record cannot be read.
    """
    if not given:
        raise ScenarioError(
            "no ground motions: name records or files, as --motions el_centro_1940_ns,peak=0.4g "
            "my_record.AT2."
        )
    found = [_motion(one, folder, step) for one in choices_of(given, "--motions")]
    refuse_twice([motion.name for motion in found], "--motions")
    refuse_twice([plain_name(motion.name) for motion in found], "--motions")  # their folders
    return found


def _motion(choice: Choice, folder: Folder, step: float) -> Motion:
    for key in choice.settings:
        if key not in _KEYS:
            raise ScenarioError(f"--motions {choice.what}: {unknown('setting', key, _KEYS)}")
    names = [row.name for row in list_ground_motions()]
    record = choice.what
    begins = [name for name in names if name.startswith(record)]
    if record not in names and not Path(record).is_file() and len(begins) == 1:
        record = begins[0]
    motion = read_ground_motion(record, Path())
    values = {key: _number(choice, key) for key in choice.settings}
    stop = values.pop("stop", float(motion.time[-1]) + values.get("start", 0.0))
    if not 0.0 < stop < 1e6:
        raise ScenarioError(f"--motions {choice.what}: stop = {stop:g} s; above 0 is right.")
    if values.get("peak", 1.0) <= 0.0:
        raise ScenarioError(
            f"--motions {choice.what}: peak = {values['peak']:g}; above 0 is right, and none at "
            "all for a record as it is."
        )
    scaled = values.get("peak", motion.peak) * abs(values.get("factor", 1.0))
    if not scaled > 0.0:
        raise ScenarioError(f"--motions {choice.what}: the ground does not move; check its factor.")
    own = record if record in names else folder.keep(Path(record))
    return Motion(
        choice.label or _said(Path(record).stem if record not in names else record, values),
        Part({"fmu": "GroundMotion"}, {"record": own, **values}),
        round(ceil(stop / step - 1e-9) * step, 9), scaled,
        motion.source if record in names else Path(record).name,
    )  # fmt: skip


def _number(choice: Choice, key: str) -> float:
    value: Value = choice.settings[key]
    if isinstance(value, str) and key == "peak" and (found := _IN_G.fullmatch(value.strip())):
        try:
            return float(found[1]) * G
        except ValueError:
            pass
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        right = "5.9 (m/s2) or 0.6g" if key == "peak" else "a number"
        raise ScenarioError(f"--motions {choice.what}: {key} = {written(value)}; {right} is right.")
    return float(value)


def _said(record: str, values: dict[str, float]) -> str:
    texts = [record]
    if "peak" in values:
        texts.append(f"{values['peak'] / G:.3g} g")
    if "factor" in values:
        texts.append(f"x {values['factor']:.3g}")
    return " ".join(texts)
