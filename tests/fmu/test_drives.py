"""Dampers under every kind of command: each name stands once, none says volt where it is none."""

from __future__ import annotations

import pytest

from bristle.fmu import catalogue
from bristle.fmu.damper import DamperSlave
from bristle.physics.drive import DRIVES, states_for

DAMPERS = [
    name
    for name in catalogue.component_names()
    if issubclass(catalogue.component_class(catalogue.source(name)), DamperSlave)
]


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("component", DAMPERS)
def test_a_damper_declares_its_variables_for_every_command(component: str, drive: str) -> None:
    names = list(catalogue.describe(component, drive=drive).variables)
    assert len(names) == len(set(names))
    assert drive in names
    assert drive == "voltage" or not [name for name in names if "voltage" in name]


def test_a_state_that_has_the_commands_name_keeps_it() -> None:
    field = DRIVES["field"]
    assert states_for(("voltage", "field"), field) == {"voltage": "held_field", "field": "field"}
    assert states_for(("voltage",), field) == {"voltage": "field"}
    assert states_for(("voltage", "field"), DRIVES["voltage"]) == {
        "voltage": "voltage", "field": "field",
    }  # fmt: skip
