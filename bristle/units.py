"""Units: read any usual spelling, write one, convert, compare dimensions.

The spelling that bristle writes is that of interfaces and FMUs: `m/s2`, `N.s/m`, `N.s/(m.V)`.
It also reads `N s/m`, `N·s/m`, `N*s/m`, `m/s^2`, `m/s**2`, `m/s²`, `m s-2`, `m/s/s`.

`g` is the standard acceleration of gravity, 9.80665 m/s2 (ISO 80000-3), and never a gram: mass
is in kg, and `mg` is a thousandth of gravity, as accelerometers have it. Nominal intensities of
published tables that use 9.81 m/s2 are not this `g`.

Hz is 1/s. Angles keep a dimension of their own, as in the BaseUnit of FMI 2.0, so that rad/s
is neither Hz nor 1/s.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import cache
from math import isclose, isfinite, pi
from typing import NamedTuple

from .errors import UnitError

DIMENSIONS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""Base units in the order of `Unit.dimension`: the attributes of FMI 2.0's BaseUnit."""

STANDARD_GRAVITY = 9.80665
"""The unit `g` [m/s2]."""

Exponents = tuple[int, ...]


class Unit(NamedTuple):
    """A unit: `value_SI = factor * value + offset`, as in the BaseUnit of FMI 2.0.

    `name` is the canonical spelling, `dimension` the exponents over `DIMENSIONS`. Two
    spellings of one unit can differ in `name` (`N` and `kg.m/s2`), so compare with
    `same_dimension` and `factor`.
    """

    name: str
    factor: float
    dimension: Exponents
    offset: float = 0.0


class Measure(NamedTuple):
    """A unit as an FMU or a package names it; `defined` is what it says the name means.

    By FMI the name is free and the BaseUnit decides. Where there is none, the name is read.
    """

    name: str
    defined: Unit | None = None

    @property
    def unit(self) -> Unit | None:
        """The unit that is meant, None where nothing says what it is."""
        if self.defined is not None:
            return self.defined
        try:
            return parse(self.name)
        except UnitError:
            return None

    @property
    def shown(self) -> str:
        """The name in brackets, with what it means where the name does not say that."""
        named = Measure(self.name).unit
        if self.defined is None or (named is not None and alike(named, self.defined)):
            return f"[{self.name}]"
        return f"[{self.name}] (defined as {in_base_units(self.defined)})"

    def change_to(self, wanted: Measure) -> tuple[float, float]:
        """Return (factor, offset) with `value_wanted = factor * value + offset`.

        Raises
        ------
        UnitError
            If nothing says what one of the units is, or they are units of different quantities.
        """
        one, other = self.unit, wanted.unit
        if one is None or other is None:
            if self.name == wanted.name:
                return 1.0, 0.0
            strange = self.name if one is None else wanted.name
            raise UnitError(
                f'{self.shown} into {wanted.shown}: nothing says what the unit "{strange}" is.'
            )
        if alike(one, other) or (self.name == wanted.name and _but_for_angles(one, other)):
            return 1.0, 0.0
        if one.dimension != other.dimension:
            raise UnitError(f"{self.shown} does not convert into {wanted.shown}.")
        return one.factor / other.factor, (one.offset - other.offset) / other.factor


def _but_for_angles(one: Unit, other: Unit) -> bool:
    """Return whether two units are one if an angle has no dimension, as many FMUs have it."""
    place = DIMENSIONS.index("rad")
    powers = other.dimension[:place] + one.dimension[place : place + 1]
    return alike(one, other._replace(dimension=powers))


def _dimension(**exponents: int) -> Exponents:
    return tuple(exponents.get(base, 0) for base in DIMENSIONS)


_NONE = _dimension()
_LENGTH = _dimension(m=1)
_FORCE = _dimension(kg=1, m=1, s=-2)
_PRESSURE = _dimension(kg=1, m=-1, s=-2)
_ACCELERATION = _dimension(m=1, s=-2)

# Symbol: (factor to SI, dimension). These take SI prefixes; kg has its own already.
_PREFIXABLE: dict[str, tuple[float, Exponents]] = {
    "m": (1.0, _LENGTH),
    "s": (1.0, _dimension(s=1)),
    "A": (1.0, _dimension(A=1)),
    "K": (1.0, _dimension(K=1)),
    "mol": (1.0, _dimension(mol=1)),
    "rad": (1.0, _dimension(rad=1)),
    "Hz": (1.0, _dimension(s=-1)),
    "N": (1.0, _FORCE),
    "Pa": (1.0, _PRESSURE),
    "J": (1.0, _dimension(kg=1, m=2, s=-2)),
    "W": (1.0, _dimension(kg=1, m=2, s=-3)),
    "V": (1.0, _dimension(kg=1, m=2, s=-3, A=-1)),
    "Ohm": (1.0, _dimension(kg=1, m=2, s=-3, A=-2)),
    "H": (1.0, _dimension(kg=1, m=2, s=-2, A=-2)),
    "T": (1.0, _dimension(kg=1, s=-2, A=-1)),
    "Gal": (0.01, _ACCELERATION),
}
_PLAIN: dict[str, tuple[float, Exponents]] = {
    "kg": (1.0, _dimension(kg=1)),
    "cd": (1.0, _dimension(cd=1)),
    "%": (0.01, _NONE),
    "deg": (pi / 180.0, _dimension(rad=1)),
    "min": (60.0, _dimension(s=1)),
    "h": (3600.0, _dimension(s=1)),
    "day": (86400.0, _dimension(s=1)),
    "g": (STANDARD_GRAVITY, _ACCELERATION),
    "mg": (1e-3 * STANDARD_GRAVITY, _ACCELERATION),
    "ug": (1e-6 * STANDARD_GRAVITY, _ACCELERATION),
    # Exact by definition: the inch of 1959, the pound of 1959 under standard gravity.
    "in": (0.0254, _LENGTH),
    "mil": (2.54e-5, _LENGTH),
    "ft": (0.3048, _LENGTH),
    "lbf": (4.4482216152605, _FORCE),
    "kip": (4448.2216152605, _FORCE),
    "kgf": (STANDARD_GRAVITY, _FORCE),
    "tf": (1e3 * STANDARD_GRAVITY, _FORCE),
    "dyn": (1e-5, _FORCE),
    "daN": (10.0, _FORCE),  # of many load cells; "da" is no prefix else
    "psi": (4.4482216152605 / 0.0254**2, _PRESSURE),
    "bar": (1e5, _PRESSURE),
    "mbar": (100.0, _PRESSURE),
    "hPa": (100.0, _PRESSURE),
}
_PREFIXES = {"n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}
_ALIASES = {"sec": "s", "ohm": "Ohm", "Ω": "Ohm", "°": "deg", "°C": "degC", "°F": "degF"}
_WITH_OFFSET = {
    one.name: one
    for one in (
        Unit("degC", 1.0, _dimension(K=1), 273.15),
        Unit("degF", 5.0 / 9.0, _dimension(K=1), 459.67 * 5.0 / 9.0),
    )
}
_LONGEST = 80  # characters
_DIGITS = 1e-6  # how far [1] two ways to write one factor may lie apart
_COMMON = ("m/s2", "m/s", "N/m", "N.s/m", "N.s/(m.V)", "rad/s", "degC")
_USUAL = (
    "m", "s", "m/s", "m/s2", "N", "Pa", "V", "A", "T", "J", "W", "kg", "Hz", "N/m", "N.s/m", "Ohm",
)  # fmt: skip
_GRAM = re.compile(r"(?i)[a-zµ]?g|(milli|kilo)?gram(me)?s?")

# Superscripts, signs and letters that look alike, each with the plain one that is meant: the
# Unicode minus, the dot of a product, both micro signs, the ohm sign, no-break spaces.
_PLAIN_TEXT = str.maketrans(
    "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺\u2212·⋅∙*\u00d7\u00b5\u03bc\u2126º\u00a0\u202f", "0123456789-+-.....uu\u03a9°  "
)
_TOKEN = re.compile(
    r"(?P<symbol>°?[A-Za-zΩ]+|[°%])(?:\^?(?P<power>[+-]?[1-9])|\^\((?P<braced>[+-]?[1-9])\))?"
    r"|(?P<sign>[./()]|1(?![0-9.]))"
)
_Factors = list[tuple[str, int]]  # symbols with their powers, in the order written


@cache
def parse(text: str) -> Unit:
    """Return the unit that a text spells.

    Parameters
    ----------
    text : str
        A product of symbols with whole powers, e.g. `N.s/(m.V)`; "", "-" and "1" mean none.

    Returns
    -------
    Unit
        Canonical name, factor to SI, dimension and, for degC and degF alone, offset.

    Raises
    ------
    UnitError
        If a symbol is not known (with the nearest that is), or the text can be read in two ways.
    """
    if len(text) > _LONGEST:
        raise UnitError(f'"{text[:_LONGEST]}..." is no unit: it has {len(text)} characters.')
    plain = text.replace("**", "^").translate(_PLAIN_TEXT).strip()
    if plain in ("", "-"):
        plain = "1"
    if (alone := _WITH_OFFSET.get(_ALIASES.get(plain, plain))) is not None:
        return alone
    tokens = _tokens(text, plain)
    factors, end = _product(text, tokens, 0)
    if end < len(tokens):
        raise _unreadable(text, tokens[end].group())
    powers: dict[str, int] = {}
    for symbol, power in factors:
        powers[symbol] = powers.get(symbol, 0) + power
    return _compose(text, {symbol: power for symbol, power in powers.items() if power})


def canonical(text: str) -> str:
    """Return a unit in the one spelling that bristle writes: `m/s^2` becomes `m/s2`.

    Raises
    ------
    UnitError
        If the unit is not known.
    """
    return parse(text).name


def same_dimension(first: str, second: str) -> bool:
    """Return whether values in one unit can be converted to the other.

    Raises
    ------
    UnitError
        If a unit is not known.
    """
    return parse(first).dimension == parse(second).dimension


def convert(value: float, source: str, target: str) -> float:
    """Return in unit `target` a value given in unit `source`.

    Raises
    ------
    UnitError
        If a unit is not known or the two differ in dimension.
    """
    factor, offset = conversion(source, target)
    return factor * value + offset


def conversion(source: str, target: str) -> tuple[float, float]:
    """Return (factor, offset) with `value_target = factor * value_source + offset`.

    For whole arrays; `convert` is the same for one number.

    Raises
    ------
    UnitError
        If a unit is not known or the two differ in dimension.
    """
    old, new = parse(source), parse(target)
    if old.dimension == new.dimension:
        return old.factor / new.factor, (old.offset - new.offset) / new.factor
    note = ""
    if "g" in (old.name, new.name):
        note = f"\n  g is the acceleration of gravity, {STANDARD_GRAVITY} m/s2; mass is in kg."
    raise UnitError(
        f'"{source}" [{_base_units(old)}] cannot become "{target}" [{_base_units(new)}]: '
        f"they differ in dimension.{note}"
    )


def definitions(told: Iterable[tuple[str, Mapping[str, str] | None]]) -> dict[str, Measure]:
    """Return the units that a file defines, by name.

    Parameters
    ----------
    told : iterable
        Name of each unit, and the attributes of its BaseUnit, None where it has none.

    Raises
    ------
    UnitError
        If one cannot be read, or is defined twice and differently.
    """
    found: dict[str, Measure] = {}
    for name, attributes in told:
        unit = None if attributes is None else defined(name, attributes)
        first = found.setdefault(name, Measure(name, unit)).defined
        if first is None:
            found[name] = Measure(name, unit)
        elif unit is not None and not alike(first, unit):
            raise UnitError(
                f'unit "{name}" is defined twice: as {in_base_units(first)} and as '
                f"{in_base_units(unit)}; one definition is right."
            )
    return found


def defined(name: str, attributes: Mapping[str, str]) -> Unit:
    """Return the unit that a BaseUnit of FMI or SSP defines.

    Parameters
    ----------
    name : str
        What the FMU or package calls it.
    attributes : mapping
        The BaseUnit's: exponents by the names of `DIMENSIONS`, `factor`, `offset`.

    Raises
    ------
    UnitError
        If an attribute is no number, a power is not whole, or the factor is 0.
    """

    def number(key: str, usual: float) -> float:
        text = attributes.get(key)
        try:
            value = usual if text is None else float(text)
        except ValueError:
            value = float("nan")
        if not isfinite(value):
            raise UnitError(f'unit "{name}": {key} = "{text}" is no finite number.')
        return value

    powers = [number(key, 0.0) for key in DIMENSIONS]
    if any(power != int(power) for power in powers):
        raise UnitError(f'unit "{name}": powers of base units are whole numbers.')
    factor = number("factor", 1.0)
    if factor == 0.0:
        raise UnitError(f'unit "{name}": its factor is 0; a unit has another one.')
    return Unit(name, factor, tuple(int(power) for power in powers), number("offset", 0.0))


def alike(one: Unit, other: Unit) -> bool:
    """Return whether two units are one, whatever they are called and with how many digits.

    Files write pi/180 and the like with six digits or more.
    """
    near = isclose(one.factor, other.factor, rel_tol=_DIGITS)
    shift = abs(one.offset - other.offset) <= _DIGITS * max(abs(one.offset), abs(other.offset))
    return one.dimension == other.dimension and near and shift


def in_base_units(unit: Unit) -> str:
    """Return what a unit is in base units: `0.001 kg.m2/s2`, `1 K + 273.15`."""
    shift = f" + {unit.offset:.9g}" if unit.offset else ""
    return f"{unit.factor:.9g} {_base_units(unit)}{shift}"


def spelling(unit: Unit) -> str | None:
    """Return how this module spells a unit that a file defines, None where it has no name for it.

    The name that the file uses is kept where it means the same here.
    """
    prefixed = (prefix + symbol for symbol in _PREFIXABLE for prefix in ("", *_PREFIXES))
    known = (*_USUAL, *_COMMON, *_PLAIN, *prefixed)
    for name in (unit.name, *known, _base_units(unit)):
        read = Measure(name).unit
        if read is not None and alike(read, unit):
            return name
    return None


def si_unit(text: str) -> str:
    """Return the SI unit of the dimension that a unit has, as engineers spell it: `bar`, Pa.

    degC and % stay what they are: so they are read.

    Raises
    ------
    UnitError
        If the unit is not known.
    """
    unit = parse(text)
    if unit.offset or unit.factor == 1.0 or unit.name == "%":
        return unit.name
    usual = (name for name in _USUAL if parse(name).dimension == unit.dimension)
    return next(usual, _base_units(unit))


def _tokens(text: str, plain: str) -> list[re.Match[str]]:
    """Cut a unit's text into symbols, operators and brackets; a space between two is a dot."""
    plain = re.sub(r"\s*([./()^])\s*", r"\1", plain)
    plain = re.sub(r"\s+", ".", plain)
    tokens = []
    position = 0
    while position < len(plain):
        token = _TOKEN.match(plain, position)
        if token is None:
            raise _unreadable(text, plain[position:])
        tokens.append(token)
        position = token.end()
    return tokens


def _product(text: str, tokens: list[re.Match[str]], position: int) -> tuple[_Factors, int]:
    """Read `a.b/c` or `a.b/(c.d)` from a position; return its factors and where it ends."""
    factors: _Factors = []
    sign = 1
    while True:
        term, position = _term(text, tokens, position)
        factors += [(symbol, sign * power) for symbol, power in term]
        operator = tokens[position].group() if position < len(tokens) else ")"
        if operator == "." and sign < 0:
            raise UnitError(
                f'unit "{text}" can be read in two ways: bracket what is divided by, '
                "as in N.s/(m.V)."
            )
        if operator not in (".", "/"):
            return factors, position
        sign = -1 if operator == "/" else 1
        position += 1


def _term(text: str, tokens: list[re.Match[str]], position: int) -> tuple[_Factors, int]:
    """Read one symbol with its power, a 1, or a bracket."""
    if position == len(tokens):
        raise _unreadable(text, "its end")
    token = tokens[position]
    if token["symbol"]:
        power = int(token["power"] or token["braced"] or 1)
        return [(_ALIASES.get(token["symbol"], token["symbol"]), power)], position + 1
    if token.group() == "1":
        return [], position + 1
    if token.group() != "(":
        raise _unreadable(text, token.group())
    factors, end = _product(text, tokens, position + 1)
    if end == len(tokens) or tokens[end].group() != ")":
        raise _unreadable(text, "(")
    return factors, end + 1


def _compose(text: str, powers: dict[str, int]) -> Unit:
    """Return the unit made of symbols with their powers."""
    ten = 0
    over, under = 1.0, 1.0
    dimension = list(_NONE)
    for symbol, power in powers.items():
        factor, exponents, prefix = _lookup(text, symbol)
        ten += prefix * power
        if power > 0:
            over *= factor**power
        else:
            under *= factor**-power
        dimension = [d + power * e for d, e in zip(dimension, exponents)]
    if abs(ten) > 99 or any(abs(power) > 9 for power in powers.values()):
        raise _unreadable(text, "its powers")
    # Powers of ten are collected, so that mm/ms and kN/m come out without rounding.
    over, under = (over * 10.0**ten, under) if ten >= 0 else (over, under * 10.0**-ten)
    return Unit(_name(powers), over / under, tuple(dimension))


def _lookup(text: str, symbol: str) -> tuple[float, Exponents, int]:
    """Return factor, dimension and power of ten of one symbol."""
    known = _PLAIN.get(symbol) or _PREFIXABLE.get(symbol)
    if known:
        return (*known, 0)
    known = _PREFIXABLE.get(symbol[1:])
    if known and symbol[0] in _PREFIXES:
        return (*known, _PREFIXES[symbol[0]])
    within = "" if symbol == text else f' in "{text}"'
    if symbol in _WITH_OFFSET:
        raise UnitError(
            f"{symbol}{within}: its zero is not that of K, so it stands alone. In a product write "
            "K."
        )
    if _GRAM.fullmatch(symbol):
        raise UnitError(
            f'unit "{symbol}"{within} is not known: grams are not read, since g is the '
            f"acceleration of gravity ({STANDARD_GRAVITY} m/s2). Mass is in kg."
        )
    raise UnitError(f'unit "{symbol}"{within} is not known.{_nearest(symbol)}')


def _name(powers: dict[str, int]) -> str:
    def spelled(sign: int) -> list[str]:
        return [
            symbol + (str(abs(power)) if abs(power) > 1 else "")
            for symbol, power in powers.items()
            if power * sign > 0
        ]

    over, under = spelled(1), spelled(-1)
    name = ".".join(over) or "1"
    if under:
        name += "/" + (under[0] if len(under) == 1 else f"({'.'.join(under)})")
    return name


def _base_units(unit: Unit) -> str:
    return _name(dict(zip(DIMENSIONS, unit.dimension)))


@cache  # titles of files ask for the same words again and again
def _nearest(symbol: str) -> str:
    prefixed = [prefix + unit for unit in _PREFIXABLE for prefix in ("", "k", "m", "c", "u")]
    known = {name.lower(): name for name in (*prefixed, *_COMMON, *_PLAIN)}
    close = get_close_matches(symbol.lower(), known, n=1, cutoff=0.5)
    return f' Did you mean "{known[close[0]]}"?' if close else " Examples: " + ", ".join(_COMMON)


def _unreadable(text: str, at: str) -> UnitError:
    return UnitError(
        f'unit "{text}" cannot be read at "{at}": a unit is a product of symbols with whole '
        "powers, as in m/s2 or N.s/(m.V)."
    )
