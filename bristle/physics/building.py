"""A building as masses, damping and stiffness, and where devices sit: the data of a Structure."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from math import isfinite, pi
from typing import Any, NamedTuple

from ..errors import PhysicsError
from .linear import cholesky, inverse

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


MAX_FLOORS = 20

ROUNDING = 1e-9
"""Share of a matrix [1] by which its entries may be wrong: files hold them with so many digits."""

Matrix = tuple[tuple[float, ...], ...]


class Building(NamedTuple):
    """Matrices of M q'' + C q' + K q = Gamma f - M Lambda a_g, relative to the ground.

    `M`, `C`, `K` (n, n) in kg, N s/m, N/m; the base comes first when `isolated`. The damper acts on
    the first mass. `stiffnesses` (n,) N/m are those below each mass (for effects of a storey).
    `devices` are those that have a place and a name; `studied` names the one whose law and effects
    measurements tell, "" for the damper on the first level (`with_damper`).
    """

    name: str
    M: Matrix
    C: Matrix
    K: Matrix
    isolated: bool
    stiffnesses: tuple[float, ...]
    devices: tuple[Device, ...] = ()
    studied: str = ""

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return len(self.M)

    def levels(self) -> list[str]:
        """Return the names of the masses: "base" where isolated, then "floor1", ..."""
        floors = self.size - 1 if self.isolated else self.size
        return (["base"] if self.isolated else []) + [f"floor{i + 1}" for i in range(floors)]

    def with_attached_mass(self, mass: float) -> Building:
        """Return the building with `mass` [kg] more on its first level."""
        M = [list(row) for row in self.M]
        M[0][0] += mass
        return self._replace(M=_freeze(M))

    def device(self, name: str) -> Device:
        """Return a device by name; "" is the damper, between the ground and the first level.

        Raises
        ------
        PhysicsError
            If there is none of that name.
        """
        if not name:
            return Device("", GROUND, 0)
        for device in self.devices:
            if device.name == name:
                return device
        known = ", ".join(device.name for device in self.devices) or "none but the damper"
        raise PhysicsError(f"building {self.name!r} has no device {name!r}; there are {known}.")

    def ports(self, device: Device) -> Ports:
        """Return the ports of a Structure at a device, or at the damper on the first level."""
        if device.name:
            return device.ports
        level = self.levels()[0]
        return Ports("damper_force", f"{level}_displacement", f"{level}_velocity", "holding_force")


PAPER: dict[str, Any] = {
    "schema": 1,
    "name": "base-isolated two-storey model",
    "masses": [1.96935633694460, 1.23224427177553, 1.23224427177553],
    "stiffnesses": [1057.0, 1366.48048703339, 1366.48048703339],
    "base": "isolated",
    "rayleigh": {"alpha": 0.213967932082332, "beta": 2.86765663228640e-4},
}
"""The content of a building file for the model of Shirazi et al. (2012)."""


def paper_building() -> Building:
    """Return the base-isolated two-storey model of Shirazi et al. (2012).

    Masses and stiffnesses follow uniquely from the natural frequencies 2.1, 5.48, 9 Hz and the
    isolation stiffness 1057 N/m of the text; Rayleigh damping of 1 % in modes 1 and 3.
    """
    return from_data(PAPER)


def from_data(data: dict[str, Any], where: str = "building") -> Building:
    """Return the building that a table of a building file describes.

    Raises
    ------
    PhysicsError
        For an unknown key, a wrong shape, a mass or stiffness that is not positive, matrices that
        are not symmetric or not positive definite, damping that adds energy.
    """
    known = {"schema", "name", "masses", "stiffnesses", "base", "damping_ratio", "modal"}
    known |= {"rayleigh", "M", "C", "K", "devices"}
    for key in data:
        if key not in known:
            raise PhysicsError(f"{where}: unknown key {key!r}; there are {sorted(known)}.")
    if data.get("schema") != 1:
        raise PhysicsError(
            "{}: schema = {!r}; this version reads 1.".format(where, data.get("schema"))
        )
    base = data.get("base", "isolated")
    if base not in ("isolated", "fixed"):
        raise PhysicsError(f'{where}: base = {base!r}; "isolated" or "fixed" is right.')
    name = str(data.get("name", "building"))
    if "M" in data or "C" in data or "K" in data:
        building = _from_matrices(data, name, base == "isolated", where)
    else:
        building = _from_chain(data, name, base == "isolated", where)
    for letter, matrix in (("M", building.M), ("K", building.K)):
        if cholesky([value for row in matrix for value in row], building.size) is None:
            raise PhysicsError(f"{where}: {letter} is not positive definite.")
    if "C" in data:
        _refuse_active(building.C, where)
    devices = read_devices(data.get("devices", []), building.levels(), where)
    return building._replace(devices=devices)


def _from_matrices(data: dict[str, Any], name: str, isolated: bool, where: str) -> Building:
    for key in ("masses", "stiffnesses", "damping_ratio", "modal", "rayleigh"):
        if key in data:
            raise PhysicsError(f"{where}: give either M, C, K or {key}, not both.")
    M, C, K = (_matrix(data, key, where) for key in ("M", "C", "K"))
    if not len(M) == len(C) == len(K):
        raise PhysicsError(f"{where}: M, C and K differ in size.")
    n = len(M)
    # A storey's stiffness is what couples it to the level below; the lowest one carries the rest.
    below = [sum(K[i][j] for j in range(n)) if i == 0 else -K[i][i - 1] for i in range(n)]
    return Building(name, M, C, K, isolated, tuple(below))


def _refuse_active(C: Matrix, where: str) -> None:
    """Raise PhysicsError where some motion would gain energy from damping."""
    n, scale = len(C), max(abs(value) for row in C for value in row) or 1.0
    A = [[0.5 * (C[i][j] / scale + C[j][i] / scale) for j in range(n)] for i in range(n)]
    _diagonalise(A)
    values = [A[i][i] for i in range(n)]
    if min(values) < -ROUNDING * max(map(abs, values)):
        raise PhysicsError(
            f"{where}: C is not positive semidefinite: its least eigenvalue is "
            f"{scale * min(values):.3g} N s/m, and that motion gains energy; none below 0 is right."
        )


def _matrix(data: dict[str, Any], key: str, where: str) -> Matrix:
    rows = data.get(key)
    if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
        raise PhysicsError(f"{where}: {key} must be a square matrix, a list of rows.")
    n = len(rows)
    if n > MAX_FLOORS + 1 or any(len(row) != n for row in rows):
        raise PhysicsError(f"{where}: {key} must be square with at most {MAX_FLOORS + 1} rows.")
    values = [[_number(value, key, where) for value in row] for row in rows]
    largest = max(abs(value) for row in values for value in row)
    if any(
        abs(values[i][j] - values[j][i]) > ROUNDING * largest for i in range(n) for j in range(i)
    ):
        raise PhysicsError(f"{where}: {key} is not symmetric.")
    return _freeze(values)


def _from_chain(data: dict[str, Any], name: str, isolated: bool, where: str) -> Building:
    masses, stiffnesses = (_positives(data, key, where) for key in ("masses", "stiffnesses"))
    n = len(masses)
    if len(stiffnesses) != n:
        raise PhysicsError(
            f"{where}: {n} masses need as many stiffnesses, found {len(stiffnesses)}."
        )
    if n > MAX_FLOORS + isolated:
        raise PhysicsError(f"{where}: at most {MAX_FLOORS} floors, found {n - isolated}.")
    M = [[masses[i] if i == j else 0.0 for j in range(n)] for i in range(n)]
    K = [[0.0] * n for _ in range(n)]
    for i, k in enumerate(stiffnesses):
        K[i][i] += k
        if i > 0:
            K[i - 1][i - 1] += k
            K[i][i - 1] -= k
            K[i - 1][i] -= k
    C = _damping(data, M, K, where)
    return Building(name, _freeze(M), _freeze(C), _freeze(K), isolated, tuple(stiffnesses))


def _damping(
    data: dict[str, Any], M: list[list[float]], K: list[list[float]], where: str
) -> list[list[float]]:
    """Return C: Rayleigh, or of given ratios in every mode: C = M (sum 2 zeta w phi phi^T) M."""
    n = len(M)
    ways = [key for key in ("damping_ratio", "modal", "rayleigh") if key in data]
    if len(ways) != 1:
        raise PhysicsError(
            "{}: give one of damping_ratio, modal, rayleigh; found {}.".format(
                where, ways or "none"
            )
        )
    if ways == ["rayleigh"]:
        alpha, beta = _rayleigh(data["rayleigh"], M, K, where)
        return [[alpha * M[i][j] + beta * K[i][j] for j in range(n)] for i in range(n)]
    if ways == ["damping_ratio"]:
        ratios = [_ratio(data["damping_ratio"], "damping_ratio", where)] * n
    else:
        given = data["modal"]
        if not isinstance(given, list) or len(given) != n:
            raise PhysicsError(f"{where}: modal needs one ratio for each of {n} modes.")
        ratios = [_ratio(value, "modal", where) for value in given]
    C = [[0.0] * n for _ in range(n)]
    for (omega, shape), zeta in zip(modes(M, K), ratios):
        weighted = [M[i][i] * shape[i] for i in range(n)]
        for i in range(n):
            for j in range(n):
                C[i][j] += 2.0 * zeta * omega * weighted[i] * weighted[j]
    return C


def _rayleigh(
    table: Any, M: list[list[float]], K: list[list[float]], where: str
) -> tuple[float, float]:
    if isinstance(table, dict) and set(table) == {"alpha", "beta"}:
        alpha, beta = (_number(table[key], "rayleigh." + key, where) for key in ("alpha", "beta"))
        if alpha < 0.0 or beta < 0.0:
            raise PhysicsError(f"{where}: rayleigh alpha and beta must not be negative.")
        return alpha, beta
    if isinstance(table, dict) and set(table) == {"ratio", "modes"}:
        zeta = _ratio(table["ratio"], "rayleigh.ratio", where)
        numbers = table["modes"]
        omegas = [omega for omega, _ in modes(M, K)]
        if (
            isinstance(numbers, list)
            and len(numbers) == 2
            and all(isinstance(m, int) and 1 <= m <= len(omegas) for m in numbers)
            and numbers[0] != numbers[1]
        ):
            first, second = omegas[numbers[0] - 1], omegas[numbers[1] - 1]
            return 2.0 * zeta * first * second / (first + second), 2.0 * zeta / (first + second)
        raise PhysicsError(
            f"{where}: rayleigh.modes must be two different numbers of 1 to {len(omegas)}."
        )
    raise PhysicsError(f"{where}: rayleigh = {{ ratio, modes = [1, 3] }} or {{ alpha, beta }}.")


def modes(M: Any, K: Any) -> list[tuple[float, list[float]]]:
    """Return the undamped modes by frequency: omega [rad/s] and mass-normalised shape (n,).

    They are the eigenvectors of L^-1 K L^-T with M = L L^T.
    """
    n = len(M)
    low = cholesky([M[i][j] for i in range(n) for j in range(n)], n)
    if low is None:
        raise PhysicsError("the mass matrix is not positive definite.")

    def forward(column: list[float]) -> list[float]:
        out: list[float] = []
        for i in range(n):
            out.append(
                (column[i] - sum(low[i * n + k] * out[k] for k in range(i))) / low[i * n + i]
            )
        return out

    half = [forward([K[i][j] for i in range(n)]) for j in range(n)]  # rows: (L^-1 K)^T
    A = [forward([half[j][i] for j in range(n)]) for i in range(n)]
    V = _diagonalise(A)
    shapes = []
    for m in range(n):
        shape = [0.0] * n
        for i in range(n - 1, -1, -1):  # back substitution with L^T
            rest = sum(low[k * n + i] * shape[k] for k in range(i + 1, n))
            shape[i] = (V[i][m] - rest) / low[i * n + i]
        shapes.append((max(A[m][m], 0.0) ** 0.5, shape))
    return sorted(shapes, key=lambda pair: pair[0])


def _diagonalise(A: list[list[float]]) -> list[list[float]]:
    """Leave the eigenvalues of a symmetric A on its diagonal; return its eigenvectors as columns.

    Jacobi's rotations (Golub & Van Loan 2013, section 8.5).
    """
    n = len(A)
    V = [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]
    for _ in range(100):
        off = sum(A[i][j] ** 2 for i in range(n) for j in range(i))
        if off <= 1e-30 * sum(A[i][i] ** 2 for i in range(n)):
            break
        for i in range(n):
            for j in range(i):
                _rotate(A, V, i, j, n)
    return V


def _rotate(A: list[list[float]], V: list[list[float]], i: int, j: int, n: int) -> None:
    if A[i][j] == 0.0:
        return
    theta = (A[j][j] - A[i][i]) / (2.0 * A[i][j])
    t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + (theta * theta + 1.0) ** 0.5)
    c = 1.0 / (t * t + 1.0) ** 0.5
    s = t * c
    for k in range(n):
        A[k][i], A[k][j] = c * A[k][i] - s * A[k][j], s * A[k][i] + c * A[k][j]
    for k in range(n):
        A[i][k], A[j][k] = c * A[i][k] - s * A[j][k], s * A[i][k] + c * A[j][k]
        V[k][i], V[k][j] = c * V[k][i] - s * V[k][j], s * V[k][i] + c * V[k][j]


def frequencies(building: Building) -> list[float]:
    """Return the undamped natural frequencies [Hz], ascending."""
    return [omega / (2.0 * pi) for omega, _ in modes(building.M, building.K)]


def with_damper(building: Building, name: str = "") -> Building:
    """Return a building of which is known whose law and effects its measurements tell.

    Parameters
    ----------
    building : without devices of its own it has the damper on the first level
    name : of the device; "" for the one that was chosen before, or the only one

    Raises
    ------
    PhysicsError
        If there is no device of that name, or there are several and none is named.
    """
    chosen = name or building.studied
    if not chosen and len(building.devices) > 1:
        names = either([repr(device.name) for device in building.devices])
        raise PhysicsError(
            f"building {building.name!r} has {len(building.devices)} devices, and which of them is "
            f"identified is not said: device = {names} (in study.toml, or --device) is right."
        )
    if not chosen and building.devices:
        chosen = building.devices[0].name
    return building._replace(studied=building.device(chosen).name)


def _number(value: Any, key: str, where: str) -> float:
    try:
        if isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value):
            return float(value)
    except OverflowError:  # an integer beyond the largest float
        value = "a number beyond 1e308"
    raise PhysicsError(f"{where}: {key} must be a finite number, found {value!r}.")


def _positives(data: dict[str, Any], key: str, where: str) -> list[float]:
    values = data.get(key)
    if not isinstance(values, list) or not values:
        raise PhysicsError(f"{where}: {key} must be a list of numbers.")
    numbers = [_number(value, key, where) for value in values]
    for i, number in enumerate(numbers):
        if number <= 0.0:
            raise PhysicsError(f"{where}: {key}[{i}] = {number!r} must be positive.")
    return numbers


def _ratio(value: Any, key: str, where: str) -> float:
    number = _number(value, key, where)
    if not 0.0 <= number < 1.0:
        raise PhysicsError(f"{where}: {key} = {number!r} must lie in [0, 1).")
    return number


def _freeze(rows: list[list[float]]) -> Matrix:
    return tuple(tuple(row) for row in rows)
