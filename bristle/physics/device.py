"""Where devices sit in a building: each acts between two levels, or between the ground and one."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ..errors import PhysicsError
from .linear import inverse

GROUND = -1
"""The ground in place of a level."""

MOST_DEVICES = 40

_WORDS = {"name", "at", "between"}
_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")


class Ports(NamedTuple):
    """The ports of a Structure at a device: the force goes in, the others come out."""

    force: str
    displacement: str
    velocity: str
    holding_force: str


class Device(NamedTuple):
    """A device by name, and the levels that it connects: `lower` is `GROUND` or below `upper`.

    Its displacement is that of the upper level relative to the lower one. A positive force resists
    it: it acts against +x on the upper level, along +x on the lower one.
    """

    name: str
    lower: int
    upper: int

    @property
    def ports(self) -> Ports:
        """The ports of a Structure at a device that has a name."""
        return Ports(*(f"{self.name}_{each}" for each in Ports._fields))

    @property
    def levels(self) -> tuple[int, int]:
        """The levels that it connects, lower first."""
        return self.lower, self.upper

    @property
    def on_first(self) -> bool:
        """Whether it is between the ground and the first level, as a building's one damper is."""
        return self.levels == (GROUND, 0)

    def crosses(self, level: int) -> bool:
        """Return whether it acts across the storey below a level, or the isolation for level 0."""
        return self.lower < level <= self.upper

    def place(self, levels: Sequence[str]) -> str:
        """Return where it sits: "at storey1", or "between the ground and floor2"."""
        for name, pair in places(levels).items():
            if pair == self.levels:
                return f"at {name}"
        low = "the ground" if self.lower == GROUND else levels[self.lower]
        return f"between {low} and {levels[self.upper]}"

    def incidence(self, n: int) -> list[float]:
        """Return b (n,): the displacement is b q, and a force f acts with -b f on the levels."""
        return [float(i == self.upper) - float(i == self.lower) for i in range(n)]


def driven_mass(M: Sequence[Sequence[float]], device: Device) -> float:
    """Return the mass [kg] that a device's force accelerates, both ends together.

    Between the ground and the first level it is that level's own, else 1/(b M^-1 b).

    Parameters
    ----------
    M : (n, n) mass matrix [kg]
    device : its levels count
    """
    if device.on_first:
        return M[0][0]
    n = len(M)
    M_inverse = inverse([value for row in M for value in row], n)
    b = device.incidence(n)
    return 1.0 / sum(b[i] * M_inverse[i * n + j] * b[j] for i in range(n) for j in range(n))


def read_devices(table: Any, levels: Sequence[str], where: str) -> tuple[Device, ...]:
    """Return the devices of a building file's `[[devices]]`.

    Parameters
    ----------
    table : the value of the key `devices`
    levels : names of the building's levels, from below
    where : the file, for messages

    Raises
    ------
    PhysicsError
        For an unknown key, place or level, a level that is connected to itself, and a name that is
        none, is given twice or makes a port that there is already.
    """
    if not isinstance(table, list) or not all(isinstance(one, dict) for one in table):
        raise PhysicsError(f"{where}: devices must be tables, [[devices]] each.")
    if len(table) > MOST_DEVICES:
        raise PhysicsError(f"{where}: at most {MOST_DEVICES} devices, found {len(table)}.")
    taken = dict.fromkeys(_ports_without_devices(levels), "the building")
    found: list[Device] = []
    for number, given in enumerate(table, 1):
        at = f"{where} [[devices]] {number}"
        for key in given:
            if key not in _WORDS:
                raise PhysicsError(f"{at}: unknown key {key!r}; there are {sorted(_WORDS)}.")
        name = given.get("name")
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise PhysicsError(
                f"{at}: name = {name!r}; small letters, digits and _ after a letter are right, at "
                "most 40 of them."
            )
        if any(device.name == name for device in found):
            raise PhysicsError(f"{at}: there are two devices of the name {name!r}.")
        device = Device(name, *_place(given, levels, f"{at} ({name})"))
        for port in device.ports:
            if port in taken:
                raise PhysicsError(
                    f"{at}: name = {name!r} makes the port {port}, which {taken[port]} has "
                    "already. Another name is right."
                )
            taken[port] = f"the device {name!r}"
        found.append(device)
    return tuple(found)


def _ports_without_devices(levels: Sequence[str]) -> Iterator[str]:
    """Yield the ports of a Structure that has no devices of its own."""
    yield from ("ground_acceleration", "damper_force", "extra_force", "holding_force")
    for i, level in enumerate(levels):
        yield from (f"{level}_{what}" for what in ("displacement", "velocity"))
        yield f"{level}_acceleration_absolute"
        yield f"drift{i + 1}"


def places(levels: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Return the places that have a name, with the levels that each connects, lower first."""
    isolated = levels[0] == "base"
    named = {"isolation": (GROUND, 0)} if isolated else {}
    for i in range(isolated, len(levels)):
        named[f"storey{i + 1 - isolated}"] = (i - 1, i)
    return named


def _place(given: dict[str, Any], levels: Sequence[str], where: str) -> tuple[int, int]:
    """Return the lower and upper level of a device."""
    if ("at" in given) == ("between" in given):
        raise PhysicsError(
            f'{where}: give either at = "storey1" or between = ["ground", "{levels[-1]}"].'
        )
    if "at" in given:
        named = places(levels)
        if not isinstance(given["at"], str) or given["at"] not in named:
            raise PhysicsError(
                f"{where}: at = {given['at']!r}; {either([repr(name) for name in named])} is right."
            )
        return named[given["at"]]
    ends = given["between"]
    known = {"ground": GROUND, **{level: i for i, level in enumerate(levels)}}
    if not isinstance(ends, list) or len(ends) != 2:
        raise PhysicsError(f"{where}: between = {ends!r}; a list of two levels is right.")
    for end in ends:
        if not isinstance(end, str) or end not in known:
            names = either([repr(name) for name in known])
            raise PhysicsError(f"{where}: between: there is no level {end!r}; {names} is right.")
    if ends[0] == ends[1]:
        raise PhysicsError(f"{where}: between connects {ends[0]} to itself; give two levels.")
    lower, upper = sorted((known[ends[0]], known[ends[1]]))
    return lower, upper


def either(names: list[str]) -> str:
    """Return names as a choice: "a, b or c"."""
    return " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))
