"""A spelling of before is an error that names the new one."""

from __future__ import annotations

import pytest

from bristle.cli import main


@pytest.mark.parametrize(
    ("line", "new"),
    [
        ("effects new rub", "new effect NAME"),
        ("laws", "list laws"),
        ("components new mine", "new controller NAME"),
        ("scenarios copy no_damper", "new scenario NAME --like SCENARIO"),
        ("compare --fmu a.fmu --data run.csv", "compare-fmu FILE.fmu --data FILE"),
        ("compare my_rig --closed-loop --draws 3", "predict FOLDER"),
        ("study check my_rig --exclude run_3", "study roles FOLDER --exclude RUN"),
        ("plan my_rig --output tests", "plan FOLDER --out PLAN"),
        ("compare my_rig --runs train", "compare FOLDER --role ROLE"),
    ],
)
def test_it_names_what_took_its_place(
    line: str, new: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    assert ended.value.code == 2
    assert new in capsys.readouterr().err
