"""What an example can hide, and how much of it is plausible on a rig."""

from __future__ import annotations

import base64
import json
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import write_whole
from ..core.text import unknown
from ..errors import StudyError
from .devices import DEVICES, Values


@dataclass(frozen=True)
class Scales:
    """What a rig's numbers are measured in: force [N], speed [m/s], stroke [m], drift [m]."""

    force: float
    speed: float
    stroke: float
    drop: float  # m/s, the speed at which the law's drag is largest
    drift: float = 0.0


@dataclass(frozen=True)
class Hidden:
    """Something that can be hidden: its name, the rigs that can have it, what it is.

    `draw(rng, scales)` gives its values in SI. `outside` for what no effect of the library is;
    `devices` that nothing commands can have it as well.
    """

    name: str
    rigs: tuple[str, ...]
    about: str
    draw: Callable[[np.random.Generator, Scales], Values]
    laws: tuple[str, ...] = ()
    outside: bool = False
    devices: tuple[str, ...] = ()


UNITS = {
    "gas_k": "N/m", "gas_length": "m", "gas_power": "1", "orifice": "N (s/m)^1.75",
    "orifice_power": "1", "valve_ratio": "1", "valve_speed": "m/s", "creep_rise": "1",
    "creep_speed": "m/s", "thinning": "s/m", "heat_capacity": "J", "heat_tau": "s",
    "fluid_mass": "kg", "mount_k": "N/m", "mount_c": "N.s/m", "mount_mass": "kg", "coil_tau": "s",
    "field_limit": "V", "spring_5": "N/m5", "rub": "N", "crack_drift": "m", "stop_gap": "m",
    "stop_k": "N/m", "bore_loss": "1", "bore_length": "m", "ripple": "N", "ripple_length": "m",
    "brace_gap": "m", "brace_k": "N/m",
}  # fmt: skip
"""Units of everything that `draw` of a hidden effect gives."""

BENCH, TOWER, BOTH = ("bench",), ("building",), ("bench", "building")


def _gas(rng: np.random.Generator, s: Scales) -> Values:
    stiffness = rng.uniform(0.25, 0.35) * s.force / s.stroke
    return {"gas_k": stiffness, "gas_length": rng.uniform(2.0, 3.0) * s.stroke, "gas_power": 1.2}


def _orifice(rng: np.random.Generator, s: Scales) -> Values:
    return {"orifice": rng.uniform(0.3, 0.5) * s.force / s.speed**1.75, "orifice_power": 1.75}


def _valves(rng: np.random.Generator, s: Scales) -> Values:
    ratio = rng.uniform(0.18, 0.28) * rng.choice([-1.0, 1.0])
    return {"valve_ratio": float(ratio), "valve_speed": rng.uniform(0.3, 0.6) * s.drop}


def _creep(rng: np.random.Generator, s: Scales) -> Values:
    return {"creep_rise": rng.uniform(0.4, 0.7), "creep_speed": rng.uniform(0.4, 0.8) * s.drop}


def _thinning(rng: np.random.Generator, s: Scales) -> Values:
    return {"thinning": rng.uniform(1.5, 2.5) / s.speed}


def _heat(rng: np.random.Generator, s: Scales) -> Values:
    energy = s.force * s.speed  # of a second at full force and speed
    return {"heat_capacity": rng.uniform(1.0, 1.6) * energy, "heat_tau": rng.uniform(10.0, 30.0)}


def _inertia(rng: np.random.Generator, s: Scales) -> Values:
    return {"fluid_mass": rng.uniform(0.06, 0.1) * s.force}  # s2/m times N


def _mount(rng: np.random.Generator, s: Scales) -> Values:
    stiffness = s.force / (rng.uniform(0.03, 0.05) * s.stroke)
    return {
        "mount_k": stiffness,
        # more than the drag falls with speed, else the piston chatters
        "mount_c": rng.uniform(0.12, 0.18) * s.force / s.drop,
        "mount_mass": 4e-4 * s.force,
    }


def _coil(rng: np.random.Generator, _s: Scales) -> Values:
    return {"coil_tau": rng.uniform(0.05, 0.08)}


def _field(rng: np.random.Generator, _s: Scales) -> Values:
    return {"field_limit": rng.uniform(3.5, 5.0)}


def _hardening(rng: np.random.Generator, s: Scales) -> Values:
    at_stroke = rng.uniform(1.0, 1.4) * s.force  # N, at 0.6 of the stroke
    return {"spring_5": at_stroke / (0.6 * s.stroke) ** 5}


def _friction(rng: np.random.Generator, s: Scales) -> Values:
    return {"rub": rng.uniform(0.06, 0.1) * s.force}


def _softening(rng: np.random.Generator, s: Scales) -> Values:
    return {"crack_drift": rng.uniform(0.9, 1.2) * s.drift}


def _stop(rng: np.random.Generator, s: Scales) -> Values:
    gap = rng.uniform(0.28, 0.34) * s.stroke
    return {"stop_gap": gap, "stop_k": rng.uniform(0.5, 0.8) * s.force / (0.1 * s.stroke)}


def _bore(rng: np.random.Generator, s: Scales) -> Values:
    return {"bore_loss": rng.uniform(0.4, 0.55), "bore_length": rng.uniform(0.2, 0.3) * s.stroke}


def _ripple(rng: np.random.Generator, s: Scales) -> Values:
    return {
        "ripple": rng.uniform(0.08, 0.12) * s.force,
        "ripple_length": rng.uniform(0.12, 0.2) * s.stroke,
    }


def _brace(rng: np.random.Generator, s: Scales) -> Values:
    gap = rng.uniform(0.25, 0.35) * s.drift
    return {"brace_gap": gap, "brace_k": rng.uniform(0.3, 0.5) * s.force / s.drift}


FALLS = ("bingham", "lugre")  # laws whose drag dies out with speed

HIDDEN = {
    one.name: one
    for one in (
        Hidden("coil_lag", BOTH, "a coil that follows the voltage late", _coil),
        Hidden("temperature", BOTH, "a fluid that thins as it warms", _heat,
               devices=("shock_absorber", "isolator")),
        Hidden("quadratic_damping", BOTH, "an orifice, its loss nearly quadratic", _orifice),
        Hidden("asymmetry", BOTH, "valves that differ between the directions", _valves,
               devices=("friction_damper", "fluid_viscous")),
        Hidden("saturation", BOTH, "a core that saturates", _field),
        Hidden("mount_compliance", BENCH, "a rubber bush at the rod's end", _mount),
        Hidden("fluid_inertia", BENCH, "the mass of the fluid in the gap", _inertia,
               devices=("shock_absorber", "fluid_viscous")),
        Hidden("stribeck", BENCH, "a yield force that is larger at creeping speed", _creep, FALLS,
               devices=("friction_damper",)),
        Hidden("flattening", BENCH, "a force that thins with speed", _thinning, FALLS),
        Hidden("base_friction", TOWER, "dry friction under the base", _friction),
        Hidden("storey_softening", TOWER, "storeys that soften with drift", _softening),
        Hidden("end_stop", TOWER, "a bumper beyond a gap", _stop),
        Hidden("gas_spring", BOTH, "a gas column beside the fluid", _gas,
               devices=("fluid_viscous",)),
        Hidden("duffing", TOWER, "isolation springs that stiffen late", _hardening),
        Hidden("worn_bore", BOTH, "a bore worn at mid-stroke", _bore, (), outside=True,
               devices=("shock_absorber", "fluid_viscous")),
        Hidden("ripple", BOTH, "a thread on the rod that runs through the seal", _ripple, (),
               outside=True, devices=tuple(DEVICES)),
        Hidden("loose_brace", TOWER, "a brace of the first storey that bears beyond its play",
               _brace, (), outside=True),
    )
}  # fmt: skip
"""What can be hidden, by name; where the library has it, by the library's name."""


def able(rig: str, law: str, *, outside: bool = False) -> list[str]:
    """Return the names of what can be hidden in a rig with a damper of that law."""
    return [
        one.name
        for one in HIDDEN.values()
        if rig in one.rigs and one.outside == outside and _fits(one, law)
    ]


def _fits(one: Hidden, law: str) -> bool:
    """Return whether a damper of a law can have what can be hidden."""
    if law in DEVICES:
        return law in one.devices
    return not one.laws or law in one.laws


def choose(
    rig: str, law: str, names: tuple[str, ...], outside: bool, rng: np.random.Generator
) -> list[Hidden]:
    """Return what is to be hidden: the names, or one that is drawn.

    Parameters
    ----------
    rig, law : str
        Which rig ("bench", "building"), and the law of its damper.
    names : tuple
        What to hide; empty for one that is drawn.
    outside : bool
        Draw among what the library does not have.
    rng : numpy.random.Generator
        What draws.

    Raises
    ------
    StudyError
        If a name is not known, or the rig cannot have it.
    """
    there = able(rig, law) + able(rig, law, outside=True)
    for name in names:
        if name not in there:
            what = f"effect to hide in a {rig} with the law {law}"
            raise StudyError(f"--effect: {unknown(what, name, there)}")
    if len(set(names)) != len(names):
        raise StudyError("--effect names one effect twice; once is right.")
    drawn = able(rig, law, outside=outside)
    chosen = names or (drawn[int(rng.integers(len(drawn)))],)
    return [HIDDEN[name] for name in chosen]


# The answer of an example, in base64 beside the study: nobody reads it by accident.

FILE = Path("sealed", "answer.txt")
COVER = "What is hidden in this rig, in base64. To read it:  bristle example reveal FOLDER"


def seal(folder: Path, answer: Mapping[str, Any]) -> None:
    """Write an answer into a study's folder.

    Parameters
    ----------
    folder : Path
        The study.
    answer : mapping
        `rig`, `law`, `noise`, `seed`, `hidden` (names), `about` (name to words), `values`
        (name to value in SI and unit), `base` (the law's values by the library's names, SI),
        `share`, where it is known, [1]; `instruments` (channel to the noise's standard deviation
        in SI).
    """
    code = base64.b64encode(json.dumps(answer).encode()).decode()
    (folder / FILE).parent.mkdir(exist_ok=True)
    write_whole(folder / FILE, "\n".join([COVER, "", *textwrap.wrap(code, 76), ""]))


def unseal(folder: Path) -> dict[str, Any]:
    """Return the answer of an example.

    Raises
    ------
    StudyError
        If the folder holds none, or its text was changed.
    """
    path = folder / FILE
    if not path.is_file():
        raise StudyError(
            f"{folder}: there is no {FILE}. Make an example with  bristle example bench NAME"
        )
    code = path.read_text(encoding="utf-8").partition("\n")[2]
    try:
        answer = json.loads(base64.b64decode("".join(code.split()), validate=True))
    except ValueError as error:
        raise StudyError(f"{path}: its text was changed; make the example again.") from error
    if not isinstance(answer, dict) or "hidden" not in answer:
        raise StudyError(f"{path}: it contains no answer; make the example again.")
    return answer


def told(answer: Mapping[str, Any], found: tuple[str, ...], kind: str) -> str:
    """Return what was hidden and what the study has found, as text.

    Parameters
    ----------
    answer : mapping
        Of `unseal`.
    found : tuple
        Effects of the study's present model, and those that its verdict names.
    kind : str
        The kind of its verdict, "" where there is none.
    """
    hidden = answer["hidden"]
    lines = [f"Hidden: {' and '.join(hidden) or 'nothing'}."]
    lines += [f"  {name}: {about}" for name, about in answer["about"].items()]
    lines += [
        f"    {name:14} {value:.4g} {'' if unit == '1' else unit}".rstrip()
        for name, (value, unit) in answer["values"].items()
    ]
    if answer.get("share"):
        lines.append(f"  It changes the force by {100 * answer['share']:.0f} % of its RMS.")
    base = ", ".join(f"{name} = {value:.4g}" for name, value in answer["base"].items())
    lines += [f"The law is {answer['law']}, in SI units:", f"    {base}"]
    said = " and ".join(found) or "no effect"
    verdict = f'verdict "{kind}"' if kind else "no verdict yet"
    lines += ["", f"Your study: {said}; {verdict}."]
    return "\n".join(lines)
