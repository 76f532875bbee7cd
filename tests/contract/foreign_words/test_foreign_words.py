"""`bristle conform` shows what an FMU itself said of its failure, in the row that fails."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from pythonfmu.builder import FmuBuilder

from bristle.cli import main

SOURCE = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Status


class {name}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = self.y = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    {method}

    def do_step(self, time, step):
        return {step}
"""
WORDS = "the valve table ends at 0.05 s (µ = 5 %)"
Ask = Callable[[str, str], dict[str, str]]


@pytest.fixture
def ask(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Ask:
    """Return a function that judges an FMU of a method and an answer, by its legal run."""
    monkeypatch.setattr(sys, "path", list(sys.path))

    def judge(method: str, step: str) -> dict[str, str]:
        name = "Valve"
        script = tmp_path / "valve_words.py"
        script.write_text(SOURCE.format(name=name, method=method, step=step), encoding="utf-8")
        sys.modules.pop("valve_words", None)
        fmu = FmuBuilder.build_FMU(script, dest=tmp_path, needsExecutionTool=False)
        sys.modules.pop("valve_words", None)
        command = ["conform", str(fmu), "--only", "legal run"]
        code = main(command)
        text = capsys.readouterr().out
        assert main([*command, "--json"]) == code
        (row,) = json.loads(capsys.readouterr().out)["rows"]
        assert code == 0 or " ".join(row["seen"].split()) in " ".join(text.split())
        assert row["verdict"] == ("fail" if code else "pass")
        found: dict[str, str] = row
        return found

    return judge


FAILING = {
    "an exception while it steps": ("", f"1 / 0 or {WORDS!r}", "division by zero"),
    "a setup of another signature": (
        "def setup_experiment(self, start_time):\n        pass",
        "True", "setup_experiment() takes 2 positional",
    ),
    "a raise in the initialisation": (
        f"def exit_initialization_mode(self):\n        raise ValueError({WORDS!r})", "True", WORDS,
    ),
    "a refusal with a warning": (
        "", f"bool(self.log({WORDS!r}, Fmi2Status.warning))", WORDS,
    ),
    "a refusal with an error": (
        "", f"bool(self.log({WORDS!r}, Fmi2Status.error))", WORDS,
    ),
    "a refusal with a line of debugging": ("", f"bool(self.log({WORDS!r}))", WORDS),
    "an exception of many lines": (
        "", "exec('raise ValueError(' + repr('too hot\\n' * 999) + ')')", "too hot",
    ),
    "the end of the process": (
        "def leave(self):\n        import os\n        self.log('it gets dark')\n        os.abort()",
        "self.leave()", "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FAILING)
def test_the_failing_row_holds_the_words_of_the_fmu(case: str, ask: Ask) -> None:
    method, step, words = FAILING[case]
    row = ask(method, step)
    assert row["verdict"] == "fail"
    seen, _, said = row["seen"].partition("; the FMU said: ")
    assert "fmi2" in seen
    assert words in said
    assert len(said) < 1000
    assert "\n" not in said


def test_an_fmu_that_says_nothing_and_one_that_passes_have_no_words(ask: Ask) -> None:
    assert "said" not in ask("", "False")["seen"]
    assert "said" not in ask("", f"self.log({WORDS!r}, Fmi2Status.warning) is None")["seen"]


def test_a_long_message_is_cut_with_a_count_of_the_rest(ask: Ask) -> None:
    row = ask("", f"bool(self.log({'x' * 8192!r}, Fmi2Status.error))")
    assert "more characters" in row["seen"]
    assert len("".join(row.values())) + len(row["seen"]) < 1000  # a report says them twice
