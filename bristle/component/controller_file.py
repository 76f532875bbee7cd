"""The controller file: what a design writes and a controller reads, in JSON.

A digest over the whole content refuses a file that was edited by hand, the building's digest one
that was designed for another building.
"""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import DesignError
from ..physics.building import Building
from .control_laws import MEASURED, SCALES, hidden_units, weight_count

SCHEMA = 1
KINDS = ("hinf", "lpv", "lqg")
POLICY = "policy"
"""The kind of a controller that is trained instead of synthesised."""
COMMAND_UNITS = {"hinf": "N", "lpv": "V", "lqg": "N", POLICY: "V"}
"""Unit of the command: a force, or the signed voltage of `switching.signed_voltage`, or a policy's
voltage."""
LARGEST = 64 * 1024**2
"""Largest controller file that is read [bytes]."""

_REMEDY = "Design it anew with `bristle design`; a controller file is not edited."


class Controller(NamedTuple):
    """A discrete controller, or a table of them even over the speed (see `linear`).

    `A` (rows n n), `B`, `W`, `C` (rows n), flat; `W` belongs to the second input: anti-windup per
    unit of its rate for "hinf" and "lpv", the damper's force for "lqg". `v_top` [m/s] is the speed
    of the last row (0 with one row). Of "policy" they are the estimator's `A` (n n), `B` (n 4), the
    network's weights `W` and the scales `C` (see `policy`). `facts` are the design's numbers for
    reports: gamma, norms, poles. `design` is the design file's content, `building` the building's
    digest.
    """

    kind: str
    title: str
    n: int
    rows: int
    v_top: float
    sample_period: float
    A: list[float]
    B: list[float]
    W: list[float]
    C: list[float]
    facts: dict[str, Any]
    design: dict[str, Any]
    building: str

    @property
    def command_unit(self) -> str:
        """Unit of the command."""
        return COMMAND_UNITS[self.kind]

    def text(self) -> str:
        """Return the content of the controller file.

        Raises
        ------
        DesignError
            If a number is not finite.
        """
        content = {"schema": SCHEMA, **self._asdict()}
        try:
            content["digest"] = _digest(content)
            return (
                json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False) + "\n"
            )
        except ValueError:
            raise DesignError(f"controller {self.title!r}: a number is not finite.") from None

    def save(self, path: str | Path) -> None:
        """Write the controller file.

        Raises
        ------
        DesignError
            If a number is not finite, or the file cannot be written.
        """
        text = self.text()
        try:
            Path(path).write_text(text, encoding="utf-8")
        except OSError as error:
            raise DesignError(f"{path}: cannot be written ({error.strerror}).") from error

    def check_building(self, building: Building, where: str = "controller") -> None:
        """Refuse a building that the controller was not designed for.

        Raises
        ------
        DesignError
            Naming both.
        """
        if building_digest(building) != self.building:
            raise DesignError(
                f"{where}: designed for the building {self.facts.get('building', '?')!r}, "
                f"not for {building.name!r} (masses, damping or stiffness differ). "
                "Design a controller for this building."
            )


def building_digest(building: Building) -> str:
    """Return 16 hexadecimal digits that stand for a building's matrices to 12 digits."""
    rows = [[f"{value:.12g}" for row in matrix for value in row] for matrix in building[1:4]]
    return _digest([rows, building.isolated])


def read_controller(path: str | Path) -> Controller:
    """Return the controller of a file.

    Raises
    ------
    DesignError
        If the file cannot be read, is no controller, was edited, or holds NaN: with the remedy.
    """
    path = Path(path)
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise DesignError(f"{path}: {size} bytes are no controller file.")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise DesignError(f"{path}: cannot be read ({error.strerror}).") from error
    except UnicodeDecodeError:
        raise DesignError(f"{path}: not a text file. {_REMEDY}") from None
    return parse_controller(text, str(path))


@lru_cache(maxsize=8)
def parse_controller(text: str, where: str = "controller") -> Controller:
    """Return the controller that a text describes.

    Raises
    ------
    DesignError
        As `read_controller`.
    """
    try:
        content = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise DesignError(f"{where}: not a controller file: {error}. {_REMEDY}") from None
    fields = {"schema", "digest", *Controller._fields}
    if not isinstance(content, dict) or set(content) != fields:
        raise DesignError(f"{where}: not a controller file: it must hold {sorted(fields)}.")
    if content.pop("schema") != SCHEMA:
        raise DesignError(f"{where}: this version reads controller files of schema {SCHEMA}.")
    given = content.pop("digest")
    try:
        whole = given == _digest({"schema": SCHEMA, **content})
    except ValueError:  # a number such as 1e999
        raise DesignError(f"{where}: a number is not finite. {_REMEDY}") from None
    if not whole:
        raise DesignError(f"{where}: the content does not match its digest. {_REMEDY}")
    controller = Controller(**content)
    _check(controller, where)
    return controller


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a finite number")


def _digest(content: Any) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _check(controller: Controller, where: str) -> None:
    """Refuse a whole file with a matching digest whose content cannot be a controller."""
    c = controller
    sizes = {"A": c.rows * c.n * c.n, "B": c.rows * c.n, "W": c.rows * c.n, "C": c.rows * c.n}
    if c.kind == POLICY:
        whole = weight_count(c.n, hidden_units(c.n, len(c.W)))
        sizes |= {"B": MEASURED * c.n, "W": whole, "C": SCALES}
    wrong = c.kind not in COMMAND_UNITS or c.n < 1 or c.rows < 1 or not c.sample_period > 0.0
    if wrong or (c.rows > 1 and not c.v_top > 0.0):
        raise DesignError(f"{where}: kind, size, sample period or top speed is wrong. {_REMEDY}")
    for name, size in sizes.items():
        values = getattr(c, name)
        if len(values) != size:
            raise DesignError(f"{where}: {name} has {len(values)} of {size} numbers. {_REMEDY}")
        if not all(isinstance(value, (int, float)) and isfinite(value) for value in values):
            raise DesignError(f"{where}: {name} holds what is not a finite number. {_REMEDY}")
