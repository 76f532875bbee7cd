"""A controller of one's own, compiled on arrays: the bits of plain Python, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from flat import Arrays, check_run
from numba.core.errors import NumbaError

from bristle.cli import main
from bristle.fmu import catalogue

OWN = '''"""FMU: a controller of one's own."""

from math import sqrt

from bristle.fmu.own_controller import OwnController


def size(v):
    return sqrt(v * v)


class Own(OwnController):
    """Relay on the velocity: as an example."""

    memory = ({memory})

    def declare_law(self):
        super().declare_law()
        self.add_parameter("gain", 30.0, "V.s/m", "volts per speed", (0.0, 1e3))
        self.add_parameter("counts", True, None, "whether samples count")
        self.add_parameter("most", 3, None, "how many of them", (0, 100))
        self.add_parameter("note", "free", None, "a text that no law reads")

    def command(self, measured, memory):
        {command}
'''
REMEMBERS = """wanted = self.gain * size(measured.base_velocity) + 0.1 * memory.last
        if self.counts:
            wanted += min(memory.count, self.most)
        return wanted, (measured.base_velocity, memory.count + 1)"""


def own(folder: Path, command: str, memory: str = "") -> str:
    path = folder / "own.py"
    path.write_text(OWN.replace("{memory}", memory).replace("{command}", command))
    return str(path)


def test_a_controller_of_ones_own(tmp_path: Path) -> None:
    check_run(own(tmp_path, REMEMBERS, '"last", "count"'), {"gain": 20.0})


def test_a_controller_of_ones_own_without_memory(tmp_path: Path) -> None:
    check_run(own(tmp_path, "return -self.gain * measured.base_velocity, ()"), {})


@pytest.mark.parametrize(
    ("command", "memory", "why"),
    [
        ("return float(self.note == 'free'), ()", "", "note"),
        ("return 1.0, (2.0, 3.0)", '"last",', "wrong tuple length"),
    ],
)
def test_what_the_compiler_refuses_of_a_controller_of_ones_own(
    tmp_path: Path, command: str, memory: str, why: str
) -> None:
    slave: Any = catalogue.instantiate(own(tmp_path, command, memory))
    with pytest.raises(NumbaError, match=why):
        Arrays(slave)


def test_the_template_of_a_controller_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "controller", "my_controller"]) == 0
    assert "my_controller.py" in capsys.readouterr().out
    check_run(str(tmp_path / "my_controller.py"), {})
