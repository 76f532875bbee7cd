"""`bristle identify FOLDER --structure`: the building alone, printed."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

import numpy as np

from ..core.text import command, plain

if TYPE_CHECKING:
    from ..study.steps import IdentifiedBuilding


def main_building(arguments: argparse.Namespace) -> int:
    """Identify the building, write its file and the step, print the tables."""
    from ..errors import StudyError
    from ..study.steps import identify_building_alone
    from ..study.study import Study

    if arguments.law:
        raise StudyError("--law is a damper's: --structure identifies the building without one.")
    found = identify_building_alone(Study(arguments.folder), write=not arguments.dry_run)
    if arguments.json:
        print(json.dumps(found.as_dict(), indent=2, ensure_ascii=False))
        return 0
    print(building_text(found))
    return 0


def building_text(found: IdentifiedBuilding) -> str:
    """Return the tables as text."""
    fit = found.fit
    levels = fit.building.levels()
    lines = [f"{fit.building.name}: {len(levels)} level(s), masses as given", ""]
    lines.append(f"  {'stiffness below':16} {'given':>12} {'found':>12} N/m   95 % interval")
    for i, level in enumerate(levels):
        given, now = (plain(one[i], 6) for one in (found.given.stiffnesses, fit.stiffnesses))
        half = _interval(fit.stiffnesses[i], fit.std_stiffnesses[i])
        lines.append(f"  {level:16} {given:>12} {now:>12}       {half}")
    lines += ["", f"  {'mode':>4} {'frequency':>12} Hz  {'95 %':18} {'damping ratio':>14}  95 %"]
    for r, (f, ratio) in enumerate(zip(fit.frequencies, fit.damping_ratios, strict=True)):
        lines.append(
            f"  {r + 1:>4} {plain(f, 5):>12}     {_interval(f, fit.std_frequencies[r]):18} "
            f"{plain(ratio, 4):>14}  {_interval(ratio, fit.std_damping_ratios[r])}"
        )
    if fit.unidentified:
        lines += ["", f"The data do not identify: {', '.join(fit.unidentified)}."]
    lines += ["", f"  {'what equilibrium leaves, worst level':38} {'before':>18} {'after':>18}"]
    for role, name in (("train", "training runs"), ("holdout", "held-out runs")):
        cells = [
            f"z = {errors[f'z_equilibrium_{role}']:.3g} ({errors[f'share_equilibrium_{role}']:.1%})"
            for errors in (found.before, found.after)
        ]
        lines.append(f"  {name:38} {cells[0]:>18} {cells[1]:>18}")
    lines.append("  z: error / noise; a true model has 1. In brackets: share of the shear.")
    for note in found.notes:
        lines += ["", f"Note: {note.rstrip('.')}."]
    if found.file is not None:
        lines += [
            "",
            f"Building: {found.file} , now the model's. As an FMU:  "
            f"{command('build', 'Structure', '--from', found.file)}",
        ]
    return "\n".join(lines)


def _interval(value: float, std: float) -> str:
    """Return half of a 95 % interval, and what share of the value it is."""
    if not np.isfinite(std):
        return "as given"
    share = f"  {plain(196.0 * std / abs(value), 2)} %" if value else ""
    return f"+- {plain(1.96 * std, 2)}{share}"
