"""Closed loops drawn at random, for figures that no scenario of the library was tuned on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import bristle.physics.effects  # noqa: F401  all of them are then registered
from bristle.core.toml_lines import toml_key, toml_value
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import LAWS

from ._motions import STEP, synthetic

LENGTH = 2.0
"""About so much of each is run [s]."""
SPACING = 0.005
"""Between two values of a record [s]."""
RECORDED = 0.55
"""Share of the ground motions that are records."""

DAMPERS = {
    "LuGreDamper": "lugre",
    "BinghamDamper": "bingham",
    "DahlDamper": "dahl",
    "TanhDamper": "tanh",
    "BoucWenDamper": "bouc_wen",
    "ModifiedBoucWenDamper": "modified_bouc_wen",
}
DAMPER_EFFECTS = ("gas_spring", "coil_lag", "stribeck", "mount_compliance", "remanence")
"""Drawn from where the law takes them."""
DESIGNED = ("ClippedOptimal", "HinfInverse", "Lpv", "LqgClipped", "TrainedPolicy")
"""Controllers that were designed for the default building."""
ALGORITHMS = ("midpoint", "gauss-seidel", "jacobi", "midpoint-iterated")
SHARES = (0.4, 0.25, 0.2, 0.15)
"""How often each of them is drawn."""

Parts = dict[str, dict[str, Any]]


def write_random(seed: int, folder: Path) -> Path:
    """Write a scenario with its building: one ground, one structure, one damper, one voltage.

    Parameters
    ----------
    seed : int
    folder : Path
        Takes random_SEED.toml and building_SEED.toml.
    """
    random = np.random.default_rng(seed)
    designed = random.random() < 0.25
    parts: Parts = {"structure": {"fmu": "Structure"}, "damper": _damper(random)}
    level = "base"
    if not designed:
        level = _building(random, folder / f"building_{seed}.toml")
        parts["structure"]["building"] = f"building_{seed}.toml"
    wires = {
        "structure.damper_force": "damper.force",
        "damper.displacement": f"structure.{level}_displacement",
        "damper.velocity": f"structure.{level}_velocity",
    }
    parts["ground"], output = _ground(random, folder / f"record_{seed}.csv")
    wires["structure.ground_acceleration"] = f"ground.{output}"
    if designed:
        _controller(parts, wires, {"fmu": str(random.choice(DESIGNED))}, "floor2")
    else:
        _voltage(random, parts, wires, level)
    if parts["damper"]["fmu"] == "BinghamDamper" and designed and random.random() < 0.5:
        parts["damper"]["parameters"] |= {"moving_mass": 1.9693563369446}
        wires["damper.holding_force"] = "structure.holding_force"
    # The ground comes before the structure, all else in any order.
    order = list(random.permutation([name for name in parts if name != "ground"]))
    order.insert(random.integers(order.index("structure") + 1), "ground")
    step = float(random.choice([0.0005, 0.001, 0.002, 0.0025, 0.004]))
    run: dict[str, Any] = {
        "stop": round(LENGTH / step) * step,
        "step": step,
        "algorithm": str(random.choice(ALGORITHMS, p=SHARES)),
    }
    file = folder / f"random_{seed}.toml"
    file.write_text(_text(run, {name: parts[name] for name in order}, wires), encoding="utf-8")
    return file


def _building(random: np.random.Generator, file: Path) -> str:
    """Write a building of 1 to 5 storeys, isolated or fixed; return the level of its damper."""
    storeys = int(random.integers(1, 6))
    isolated = bool(random.random() < 0.7)
    masses = random.uniform(1.5, 4.0, storeys + isolated)
    # So stiff that the building alone would have a first frequency [Hz] of about this.
    own = 2.0 * np.pi * random.uniform(3.0, 6.0)
    stiffnesses = masses[-1] * own**2 * random.uniform(0.8, 1.2, storeys) * (storeys + 1) / 2.0
    if isolated:
        layer = masses.sum() * (2.0 * np.pi * random.uniform(0.6, 1.6)) ** 2
        stiffnesses = np.concatenate([[layer], stiffnesses])
    data: dict[str, Any] = {
        "schema": 1,
        "masses": [round(float(m), 3) for m in masses],
        "stiffnesses": [round(float(k), 1) for k in stiffnesses],
        "base": "isolated" if isolated else "fixed",
        "damping_ratio": round(float(random.uniform(0.005, 0.04)), 4),
    }
    lines = [f"{key} = {toml_value(value)}" for key, value in data.items()]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return "base" if isolated else "floor1"


def _damper(random: np.random.Generator) -> dict[str, Any]:
    """Return a damper of any law, its parameters off the usual ones, an effect now and then."""
    fmu = str(random.choice(list(DAMPERS)))
    given: dict[str, Any] = {
        name: parameter.value * float(np.exp(random.uniform(-0.3, 0.3)))
        for name, parameter in LAWS[DAMPERS[fmu]].parameters.items()
        if name not in ("exponent", "n")
    }
    if random.random() < 0.25:
        taken = [name for name in DAMPER_EFFECTS if EFFECTS[name].joins(LAWS[DAMPERS[fmu]])]
        given[f"{random.choice(taken)}.on"] = True
    return {"fmu": fmu, "parameters": given}


def _ground(random: np.random.Generator, file: Path) -> tuple[dict[str, Any], str]:
    """Return a record, written into a file, or a signal, and the name of its output."""
    size = float(random.uniform(0.5, 4.0))
    if random.random() < RECORDED:
        values = synthetic(int(random.integers(2**31)), 1.0, pulse=bool(random.random() < 0.5))
        begin, count = round(random.uniform(1.0, 3.0) / STEP), round(LENGTH / SPACING) + 2
        values = values[begin :: round(SPACING / STEP)][:count]
        values[0] = 0.0
        rows = [f"{SPACING * i:.3f},{a:.6f}" for i, a in enumerate(values)]
        file.write_text("\n".join(["time [s],acceleration [m/s2]", *rows]) + "\n")
        given = {"record": file.name, "peak": size, "factor": 1.0}
        return {"fmu": "GroundMotion", "parameters": given}, "ground_acceleration"
    kind = str(random.choice(["half_sine", "sine", "chirp"]))
    signal: dict[str, Any] = {"kind": kind, "amplitude": size}
    if kind == "half_sine":
        signal["duration"] = float(random.uniform(0.1, 0.6))
    elif kind == "sine":
        signal["frequency"] = float(random.uniform(0.5, 6.0))
    else:
        signal |= {"frequency": 0.3, "frequency_end": 8.0, "duration": LENGTH}
    return {"fmu": "SignalSource", "parameters": signal}, "value"


def _voltage(random: np.random.Generator, parts: Parts, wires: dict[str, str], level: str) -> None:
    """Add what gives the voltage: constant, a signal, or a controller for any building."""
    kind = random.choice(
        ["constant", "sine", "steps", "inverse", "switch"], p=[0.4, 0.15, 0.1, 0.2, 0.15]
    )
    if kind in ("inverse", "switch"):
        given = {"kind": str(kind), "gain": float(random.uniform(20.0, 120.0))}
        _controller(parts, wires, {"fmu": "Skyhook", "parameters": given}, level)
        return
    signal: dict[str, Any] = {"level": float(random.uniform(0.0, 8.0))}
    if kind == "sine":
        signal = {"kind": "sine", "offset": 4.0, "amplitude": 4.0}
        signal["frequency"] = float(random.uniform(0.3, 3.0))
    elif kind == "steps":
        pairs = [f"{t:.4g}:{random.uniform(0.0, 8.0):.3g}" for t in np.arange(0.0, LENGTH, 0.4)]
        signal = {"kind": "steps", "steps": " ".join(pairs)}
    fmu, output = (
        ("ConstantVoltage", "voltage") if kind == "constant" else ("SignalSource", "value")
    )
    parts["voltage"] = {"fmu": fmu, "parameters": signal}
    wires["damper.voltage"] = f"voltage.{output}"


def _controller(
    parts: Parts, wires: dict[str, str], controller: dict[str, Any], floor: str
) -> None:
    parts["controller"] = controller
    moved = wires["damper.displacement"].removesuffix("_displacement")
    wires |= {
        "damper.voltage": "controller.voltage",
        "controller.floor_acceleration": f"structure.{floor}_acceleration_absolute",
        "controller.base_displacement": f"{moved}_displacement",
        "controller.base_velocity": f"{moved}_velocity",
        "controller.damper_force": "damper.force",
    }


def _text(run: dict[str, Any], parts: Parts, wires: dict[str, str]) -> str:
    lines = ["schema = 1", "", "[run]"]
    lines += [f"{key} = {toml_value(value)}" for key, value in run.items()]
    for name, part in parts.items():
        lines += ["", f"[components.{name}]"]
        lines += [f"{key} = {_value(value)}" for key, value in part.items()]
    lines += ["", "[connections]"]
    lines += [f'"{target}" = "{source}"' for target, source in wires.items()]
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{toml_key(k)} = {toml_value(v)}' for k, v in value.items())} }}"
    return toml_value(value)
