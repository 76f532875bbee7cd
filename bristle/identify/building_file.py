"""A building as identified, written as the file that everything else reads."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..physics.building import Building, from_data
from .building import StructureFit
from .simulated import stiffness_matrix

Array = NDArray[np.float64]


def building_text(fit: StructureFit, origin: Sequence[str] = ()) -> str:
    """Return the building file (schema 1) of an identified building, its intervals as comments.

    A chain of masses is written as masses, stiffnesses and modal damping ratios, anything else as
    its matrices. `origin` are lines that say where it comes from.
    """
    building = fit.building
    lines = [f"# {line}" for line in origin]
    lines += ["schema = 1", f"name = {json.dumps(building.name)}"]
    lines.append(f'base = "{"isolated" if building.isolated else "fixed"}"')
    if is_chain(building):
        masses = [row[i] for i, row in enumerate(building.M)]
        ratios = np.maximum(fit.damping_ratios, 0.0)
        lines += ["", f"masses = {_row(masses)}  # kg, as given", ""]
        lines += _with_intervals("stiffnesses", "N/m", building.stiffnesses, fit.std_stiffnesses)
        lines += ["", *_with_intervals("modal", "1", ratios, fit.std_damping_ratios)]
    else:
        lines += ["", "# kg, N s/m, N/m; stiffnesses and modal damping ratios as identified:"]
        lines += [
            f"# {line}" for line in _with_intervals("", "N/m", fit.stiffnesses, fit.std_stiffnesses)
        ]
        lines += [
            f"# {line}"
            for line in _with_intervals("", "1", fit.damping_ratios, fit.std_damping_ratios)
        ]
        for letter, matrix in (("M", building.M), ("C", building.C), ("K", building.K)):
            lines += ["", f"{letter} = [", *(f"  {_row(row)}," for row in matrix), "]"]
    for device in building.devices:
        names = ["ground", *building.levels()]
        ends = ", ".join(json.dumps(names[i + 1]) for i in device.levels)
        lines += ["", "[[devices]]", f"name = {json.dumps(device.name)}", f"between = [{ends}]"]
    text = "\n".join([*lines, ""])
    _check(text, building)
    return text


def is_chain(building: Building) -> bool:
    """Return whether a building is masses on springs, each between its neighbours."""
    M, K = np.array(building.M), np.array(building.K)
    loose = building._replace(K=tuple(tuple(0.0 for _ in row) for row in K))
    loose = loose._replace(stiffnesses=(0.0,) * building.size)
    chain = stiffness_matrix(loose, np.array(building.stiffnesses))
    diagonal = not np.any(M - np.diag(np.diag(M)))
    return diagonal and bool(np.allclose(K, chain, rtol=0.0, atol=1e-9 * np.abs(K).max()))


def _with_intervals(key: str, unit: str, values: Sequence[float] | Array, std: Array) -> list[str]:
    """Return the lines of a list, one value each, with half of its 95 % interval."""
    rows = [
        f"  {float(value)!r}, "
        + (
            f"# +- {1.96 * s:.2g} {unit}"
            if np.isfinite(s)
            else "# as given: the data do not identify it"
        )
        for value, s in zip(values, std, strict=True)
    ]
    return [f"{key} = [".removeprefix(" = "), *rows, "]"]


def _row(values: Sequence[float]) -> str:
    return f"[{', '.join(repr(float(value)) for value in values)}]"


def _check(text: str, building: Building) -> None:
    """Hold the line between what is written and what is read."""
    import tomllib

    read = from_data(tomllib.loads(text))
    assert read.devices == building.devices, "the file says otherwise"
    for ours, theirs in ((building.M, read.M), (building.C, read.C), (building.K, read.K)):
        size = np.abs(np.array(ours)).max()
        assert np.allclose(ours, theirs, rtol=0.0, atol=1e-6 * size), "the file says otherwise"
