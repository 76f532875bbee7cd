"""`check` and `import-ssp` end: ten lines and 1,000 characters, with a count of the rest."""

from __future__ import annotations

import json
from pathlib import Path

from described import component, write_ssp

from bristle.cli import main

SCENARIO = """schema = 1
name = "many"
[run]
step = 0.001
stop = 1.0
"""


def written(folder: Path, mistakes: int) -> str:
    path = folder / "many.toml"
    keys = "".join(f"wrong_{k} = {k}\n" for k in range(mistakes))
    path.write_text(SCENARIO + keys, encoding="utf-8")
    return str(path)


def test_check_says_the_errors_first_and_how_many_more_there_are(tmp_path, capsys) -> None:
    file = written(tmp_path, 400)
    assert main(["check", file]) == 2
    said = capsys.readouterr().out
    *lines, rest, _ = said.splitlines()
    assert len(lines) <= 8
    assert len(said) <= 1000
    assert all(": error: " in line for line in lines)
    assert rest.endswith("more lines; all:  --json")
    assert main(["check", file, "--json"]) == 2
    found = json.loads(capsys.readouterr().out)["files"][0]["findings"]
    assert len(found) >= 400


def test_a_few_are_said_as_they_are(tmp_path, capsys) -> None:
    assert main(["check", written(tmp_path, 3)]) == 2
    said = capsys.readouterr().out
    assert "more line" not in said
    assert [f"wrong_{k}" in said for k in range(3)] == [True] * 3


def test_import_ssp_says_a_few_notes_and_how_many_more_there_are(toys, tmp_path, capsys) -> None:
    values = "".join(
        f'<v:Parameter name="gain_{k}"><v:Real value="1"/></v:Parameter>' for k in range(60)
    )
    inner = (
        "<d:ParameterBindings><d:ParameterBinding><d:ParameterValues><v:ParameterSet>"
        f"<v:Parameters>{values}</v:Parameters></v:ParameterSet></d:ParameterValues>"
        "</d:ParameterBinding></d:ParameterBindings>"
    )
    body = f"<d:Elements>{component('g', inner)}</d:Elements>"
    package = write_ssp(tmp_path / "my.ssp", body, {"g": toys["Gain"]})
    command = ["import-ssp", str(package), "-o", str(tmp_path / "out")]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert len(said.splitlines()) <= 10
    assert len(said) <= 1000
    assert "more lines; all:  --json" in said
    assert main([*command[:-1], str(tmp_path / "again"), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["notes"]) >= 60
