"""Components that fail: the run stops, says who, when and with which inputs, and keeps its rows."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from toys import Maker

from bristle import run
from bristle.engine.run import IncompleteRunError
from bristle.errors import FmuError, RunError
from bristle.fmu.build import ensure


def failing(scenario_of: Maker, how: str, at: float = 0.5) -> Path:
    """Return a scenario whose component `bad` fails in the step to t = `at`."""
    return scenario_of(
        {"ramp": "Ramp", "bad": "Failing"},
        {"bad.u": "ramp.value"},
        parameters={"bad": {"how": how, "at": at}},
    )


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("discard", "bad in the step from t = 0.4 s: doStep answered Discard"),
        ("raise", "bad in the step from t = 0.4 s: doStep answered Fatal"),
        ("raise", "this component breaks"),
        ("fault and discard", "Discard: fault 1, an input is not finite"),
        ("discard", "Inputs: u = 0.5"),
        ("discard", "Rows up to t = 0.4 s are kept"),
    ],
)
def test_failing_step_names_component_time_and_inputs(
    scenario_of: Maker, how: str, words: str
) -> None:
    with pytest.raises(IncompleteRunError) as caught:
        run(failing(scenario_of, how))
    assert words in str(caught.value)
    assert caught.value.exit_code == 1
    frame = caught.value.frame
    assert frame.attrs["complete"] is False
    assert frame["ramp.value"].to_numpy() == pytest.approx(np.arange(5) / 10)


def test_fault_stops_the_run_and_its_row_is_kept(scenario_of: Maker) -> None:
    with pytest.raises(
        IncompleteRunError,
        match=r"bad at t = 0\.5 s: fault 4, a state or output is not finite or out of bounds",
    ) as caught:
        run(failing(scenario_of, "fault"))
    assert caught.value.frame["bad.fault"].to_list() == [0, 0, 0, 0, 0, 4]


def test_fault_at_the_start_stops_before_the_first_step(scenario_of: Maker) -> None:
    with pytest.raises(
        IncompleteRunError, match=r"bad at t = 0 s: fault 5, a parameter or record is wrong"
    ) as caught:
        run(failing(scenario_of, "fault", at=0.0))
    assert len(caught.value.frame) == 1


INERTIA = """
schema = 1
title = "an acceleration that no mass survives"

[run]
stop = 0.1
step = 0.01

[components.jump]
fmu = "SignalSource"
parameters = { kind = "steps", steps = "0:0 0.05:1e308" }

[components.damper]
fmu = "LuGreDamper"
parameters = { displacement = 0.0, velocity = 0.0, voltage = 4.0, "fluid_inertia.on" = true, \
"fluid_inertia.m_f" = 50.0 }

[connections]
"damper.acceleration" = "jump.value"
"""


def test_what_the_fmu_said_of_its_fault_stands_in_the_error(tmp_path: Path) -> None:
    (tmp_path / "inertia.toml").write_text(INERTIA)
    with pytest.raises(IncompleteRunError, match=r"It said: damper: .* not finite: force"):
        run(tmp_path / "inertia.toml")


def test_what_the_fmu_said_of_a_parameter_stands_in_the_error(tmp_path: Path) -> None:
    fmu = ensure("GroundMotion")
    text = f'schema = 1\n[run]\nstop = 0.1\nstep = 0.01\n[components.ground]\nfmu = "{fmu}"\n'
    (tmp_path / "own.toml").write_text(f'{text}parameters = {{ record = "nosuch.csv" }}\n')
    with pytest.raises(IncompleteRunError, match=r"It said: ground: .* there is no such file"):
        run(tmp_path / "own.toml")


def test_nan_of_a_foreign_fmu_is_recorded_and_the_run_goes_on(scenario_of: Maker) -> None:
    values = run(failing(scenario_of, "nan", at=0.9))["bad.value"]
    assert values.isna().sum() == 2
    assert values.iloc[:9].notna().all()


def test_nan_input_is_named_when_a_component_refuses_it(scenario_of: Maker) -> None:
    file = scenario_of(
        {"bad": "Failing", "next": "Failing"},
        {"next.u": "bad.value"},
        parameters={"bad": {"how": "nan", "u": 0.0}, "next": {"how": "fault and discard"}},
    )
    with pytest.raises(RunError, match=r"next .* fault 1.*\n  Inputs: u = nan"):
        run(file)


@pytest.fixture
def warnings_seen(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    with caplog.at_level(logging.WARNING, logger="bristle"):
        yield caplog


def test_warning_is_shown_once_and_logged_each_time(
    scenario_of: Maker, tmp_path: Path, warnings_seen: pytest.LogCaptureFixture
) -> None:
    run(failing(scenario_of, "warning", at=0.3), out=tmp_path / "out")
    assert [r.getMessage() for r in warnings_seen.records] == ["bad: it gets warm"]
    assert (tmp_path / "out" / "log").read_text().count("it gets warm") == 8


def test_unsettled_algebraic_loop_is_named(scenario_of: Maker) -> None:
    file = scenario_of(
        {"a": "Gain", "b": "Gain"},
        {"a.u": "b.y", "b.u": "a.y"},
        parameters={"a": {"offset": 1.0}},
    )
    with pytest.raises(RunError) as caught:
        run(file)
    assert "algebraic loop" in str(caught.value)
    assert "a.u -> a.y -> b.u -> b.y -> a.u" in str(caught.value)


def test_fmu_of_another_platform_is_explained(scenario_of: Maker, tmp_path: Path) -> None:
    import zipfile

    from bristle.engine.instance import Instance, Unpacked
    from bristle.fmu.description import read_description

    bare = tmp_path / "bare.fmu"
    with zipfile.ZipFile(scenario_of.toys["Ramp"]) as old, zipfile.ZipFile(bare, "w") as new:
        for name in old.namelist():
            if "binaries/linux" not in name:
                new.writestr(name, old.read(name))
    description = read_description(bare, any_platform=True)
    with (
        Unpacked() as unpacked,
        pytest.raises(FmuError, match=r"no binary for this platform .*(?s:.)*--engine compiled"),
    ):
        Instance("ramp", description, unpacked.folder(bare), print)


def test_fmu_that_raises_while_it_is_made_says_why(scenario_of: Maker, tmp_path: Path) -> None:
    import zipfile

    from bristle.engine.instance import Instance, Unpacked
    from bristle.fmu.description import read_description

    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(scenario_of.toys["Ramp"]) as old, zipfile.ZipFile(broken, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name.endswith("ramp_toy.py"):
                data = data.replace(b"import os\n", b"import a_module_that_is_not_there\n")
            new.writestr(name, data)
    description = read_description(broken)
    with (
        Unpacked() as unpacked,
        pytest.raises(FmuError, match=r"cannot be instantiated(?s:.)*a_module_that_is_not_there"),
    ):
        Instance("ramp", description, unpacked.folder(broken), lambda message: None)


def test_ctrl_c_while_an_fmu_is_made_is_no_failure_of_it(
    scenario_of: Maker, tmp_path: Path
) -> None:
    import zipfile

    from bristle.engine import instance as session
    from bristle.fmu.description import read_description

    slow = tmp_path / "slow.fmu"
    signals = b"import os\nimport signal\nos.kill(os.getpid(), signal.SIGINT)\n"
    with zipfile.ZipFile(scenario_of.toys["Ramp"]) as old, zipfile.ZipFile(slow, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name.endswith("ramp_toy.py"):
                data = data.replace(b"import os\n", signals)
            new.writestr(name, data)
    description, said = read_description(slow), list[session.Message]()
    known = dict(session._LISTENERS)
    with session.Unpacked() as unpacked, pytest.raises(KeyboardInterrupt):
        session.Instance("ramp", description, unpacked.folder(slow), said.append)
    assert said == []
    assert known == session._LISTENERS


def test_python_that_offers_no_symbols_is_explained(
    scenario_of: Maker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **named: object) -> None:
        raise OSError("x.so: undefined symbol: _Py_NoneStruct")

    monkeypatch.setattr("bristle.engine.instance.FmuLibrary", refuse)
    with pytest.raises(FmuError, match=r"_Py_NoneStruct(?s:.)*--enable-shared.*LD_PRELOAD"):
        run(scenario_of({"ramp": "Ramp"}))
