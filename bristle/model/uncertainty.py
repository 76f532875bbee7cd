"""How the errors of identified parameters go together, in a model.toml.

[correlation]
parameters = ["sigma_a", "gas_spring.k"]
rows = [[1.0], [-0.42, 1.0]]

The rows are the lower triangle of the matrix of correlations, with the diagonal. With the standard
deviations of the parameters it is their covariance.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.config import ANY, Document, Key, Spec
from ..core.text import unknown, written
from ..errors import StudyError

_DIGITS = 9
_SLACK = 1e-7
"""How far below zero rounding may put an eigenvalue of a matrix of correlations, by its size."""


@dataclass(frozen=True)
class Correlation:
    """How the errors of identified parameters go together.

    `names` as FMUs have them ("f_c", "gas_spring.k"); `rows` the lower triangle of the matrix,
    diagonal included.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]

    def matrix(self) -> Array:
        """Return the whole matrix (p, p), symmetric."""
        out = np.zeros((len(self.names), len(self.names)))
        for i, row in enumerate(self.rows):
            out[i, : i + 1] = out[: i + 1, i] = row
        return out

    def of(self, names: Sequence[str]) -> Correlation:
        """Return the part that is about some of the parameters, in this order."""
        index = [self.names.index(name) for name in self.names if name in names]
        return correlation_of([self.names[i] for i in index], self.matrix()[np.ix_(index, index)])


def correlation_of(names: Sequence[str], matrix: Array) -> Correlation:
    """Return a matrix of correlations (p, p) as a file holds it."""
    rows = [tuple(round(float(v), _DIGITS) for v in matrix[i, : i + 1]) for i in range(len(names))]
    return Correlation(tuple(names), tuple(rows))


def correlation_of_covariance(names: Sequence[str], covariance: Array) -> Correlation:
    """Return the correlations of parameters whose covariance is given, (p, p)."""
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    safe = np.where(spread > 0.0, spread, 1.0)
    matrix = np.clip(covariance / np.outer(safe, safe), -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    return correlation_of(names, matrix)


def covariance_of(
    names: Sequence[str], std: Sequence[float], correlation: Correlation | None
) -> Array:
    """Return the covariance (p, p) of errors with these standard deviations.

    What has no correlation stored counts as independent.
    """
    whole = np.eye(len(names))
    if correlation is not None:
        known = correlation.of(names)
        index = [list(names).index(name) for name in known.names]
        whole[np.ix_(index, index)] = known.matrix()
    return whole * np.outer(std, std)


def _names(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or len({str(name) for name in value}) != len(value):
        raise StudyError(f"is {written(value)}: expected a list of names, each once.")
    return tuple(map(str, value))


CORRELATION = Spec({"parameters": Key(_names, None), "rows": ANY})


def read_correlation(
    document: Document, found: Mapping[str, Any], parameters: Collection[str],
    uncertain: Collection[str],
) -> Correlation | None:  # fmt: skip
    """Return the correlations of a file, None after an error, which `document` then has.

    Parameters
    ----------
    document, found : takes what is wrong; the table
    parameters, uncertain : names of all parameters, and of those with a standard deviation
    """
    names, rows = found["parameters"], found["rows"]
    here = "correlation", "parameters"
    if names is None:
        document.error(here, "[correlation] parameters is missing: expected a list of names.")
        return None
    for name in names:
        if name not in parameters:
            document.error(here, unknown("parameter", name, list(parameters)))
        elif name not in uncertain:
            document.error(here, f"{name} has no std, which its covariance needs.")
    if not _is_triangle(rows, len(names)):
        document.error(
            ("correlation", "rows"),
            f"[correlation] rows: expected the lower triangle for {len(names)} parameters: row i "
            "has i numbers of -1 to 1, the last one 1.",
        )
        return None
    made = Correlation(names, tuple(tuple(map(float, row)) for row in rows))
    if names and (least := float(np.linalg.eigvalsh(made.matrix())[0])) < -_SLACK * len(names):
        document.error(
            ("correlation", "rows"),
            f"no errors can correlate like this: the matrix has the eigenvalue {least:.3g}, below "
            "zero. Identify again, or remove the table.",
        )
    return made


def _is_triangle(rows: Any, count: int) -> bool:
    """Return whether rows are the lower triangle of a matrix of correlations."""
    return (
        isinstance(rows, list)
        and len(rows) == count
        and all(isinstance(row, list) and len(row) == i for i, row in enumerate(rows, 1))
        and all(map(_is_share, (value for row in rows for value in row)))
        and all(float(row[-1]) == 1.0 for row in rows)
    )


def _is_share(value: Any) -> bool:
    """Return whether a value is a number of -1 to 1."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -1.0 <= value <= 1.0


def set_correlation(
    document: Any, correlation: Correlation | None, uncertain: Sequence[str]
) -> None:
    """Put the correlations of what has a standard deviation into a file in place of its own."""
    import tomlkit

    document.pop("correlation", None)
    found = correlation.of(uncertain) if correlation is not None else None
    if found is None or not found.names:
        return
    table, rows = tomlkit.table(), tomlkit.array()
    for row in found.rows:
        rows.append(list(row))
    table["parameters"], table["rows"] = list(found.names), rows.multiline(True)
    document["correlation"] = table
