"""Comparisons of controllers that the page orders: STUDY/comparisons/1 and so on.

The page compares nothing: `bristle controllers` does, and what it found is in such a folder.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from ..findings import written
from .designs import FOLDER as DESIGNS
from .designs import design_name
from .message import RequestError
from .names import UPLOADS, batch_name, file_name

FOLDER = "comparisons"
MOTIONS = 12
"""Ground motions that one comparison may have."""
MEMBERS = 200
"""Members that a worst case may have."""
PEAK = 3.0
"""Largest peak [g] to which a motion may be scaled."""

_WORD = re.compile(r"[A-Za-z]\w{0,79}")
_NUMBER = re.compile(r"[1-9][0-9]{0,3}")


def numbers_of(folder: Path) -> list[int]:
    """Return the numbers of a study's comparisons, the oldest first, finished or not."""
    found = (folder / FOLDER).glob("*/")
    return sorted(int(one.name) for one in found if _NUMBER.fullmatch(one.name))


def words(study: str, options: Mapping[str, Any]) -> list[str]:
    """Return the words of `bristle controllers` for what a page asks for.

    Parameters
    ----------
    study : whose folder keeps the comparison
    options : `number` of the comparison; `motions`, each a `record` with its `peak` [g], None as
        recorded; `controllers` of the library; `designs` of the study; `damper` a study, ""
        for the library's; `building` a file of a study, "" for the library's, and `device` of it;
        `members` of the worst case, 0 without; `limit`

    Raises
    ------
    RequestError
        If one of them is not right.
    """
    motions = [_motion(one) for one in _list(options, "motions")]
    if not 1 <= len(motions) <= MOTIONS:
        raise RequestError(f"motions: {len(motions)}; 1 to {MOTIONS} ground motions are right.")
    controllers = [_word("controllers", one) for one in _list(options, "controllers")]
    designs = [design_name(one) for one in _list(options, "designs")]
    chosen = [*controllers, *(f"{study}/{DESIGNS}/{name}.json" for name in designs)]
    if not chosen:
        raise RequestError("controllers: none is chosen; one or more are right.")
    found = ["controllers", *_place(options), "--motions", *motions, "--controller", *chosen]
    if options.get("damper"):
        found.append(f"--damper={file_name(options['damper'], 'the damper')}")
    if members := _whole(options, "members", 0, MEMBERS):
        found.append(f"--ensemble={members}")
    if options.get("limit") is True:
        found.append("--limit")
    return [*found, f"--out={study}/{FOLDER}/{_whole(options, 'number', 1, 9999)}"]


def _place(options: Mapping[str, Any]) -> list[str]:
    """Return the words about the building and where its damper is."""
    building, device = options.get("building"), options.get("device")
    if not building:
        return []
    if not isinstance(building, str):
        raise RequestError(f"building: {written(building)}; STUDY/FILE is right.")
    path = "/".join(file_name(part, "the building") for part in building.split("/"))
    return [f"--building={path}", *([f"--device={_word('device', device)}"] if device else [])]


def _motion(asked: object) -> str:
    """Return a ground motion as the command takes it."""
    if not isinstance(asked, Mapping):
        raise RequestError(f"motions: {written(asked)}; a record with its peak is right.")
    text, peak = record_name(asked.get("record")), asked.get("peak")
    return text if peak is None else f"{text},peak={peak_of(text, peak):.6g}g"


def record_name(record: object) -> str:
    """Return the name of a ground motion, or a dropped file's; RequestError if it is neither."""
    if isinstance(record, str) and record.startswith(f"{UPLOADS}/") and record.count("/") == 2:
        _, batch, name = record.split("/")
        return f"{UPLOADS}/{batch_name(batch)}/{file_name(name, 'the record')}"
    return _word("motions", record)


def peak_of(motion: str, peak: object) -> float:
    """Return the peak [g] to which a ground motion is scaled; RequestError if it cannot be."""
    if isinstance(peak, bool) or not isinstance(peak, int | float) or not isfinite(peak):
        raise RequestError(f"{motion}: peak = {written(peak)}; a number in g is right.")
    if not 0.0 < peak <= PEAK:
        raise RequestError(f"{motion}: peak = {peak:g} g; above 0, to {PEAK:g} g, is right.")
    return float(peak)


def _list(options: Mapping[str, Any], key: str) -> list[Any]:
    found = options.get(key, [])
    if not isinstance(found, list):
        raise RequestError(f"{key}: {written(found)}; a list is right.")
    return found


def _word(key: str, text: object) -> str:
    if not isinstance(text, str) or not _WORD.fullmatch(text):
        raise RequestError(f"{key}: {written(text)}; a name is right.")
    return text


def _whole(options: Mapping[str, Any], key: str, low: int, high: int) -> int:
    value = options.get(key, 0)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise RequestError(f"{key}: {written(value)}; a whole number, {low} to {high}, is right.")
    return value
