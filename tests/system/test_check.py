"""`bristle check`: plain lines that an editor can follow, JSON, the schema, the exit code."""

import json

import pytest
from valid import VALID

from bristle.cli import main
from bristle.core import files
from bristle.system.schema import build_schema, schema_text

PLAIN = VALID.replace('parameters = { "gas_spring.on" = true, "gas_spring.k" = 80.0 }\n', "")


@pytest.fixture
def write(tmp_path):
    def to_file(text, name="my.toml"):
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        return str(file)

    return to_file


def test_a_right_file_is_ok(write, capsys, tmp_path):
    file = write(PLAIN)
    assert main(["check", file]) == 0
    assert capsys.readouterr().out == f"{file}: ok\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["my.toml"]


def test_every_mistake_has_a_line_that_an_editor_can_follow(write, capsys):
    file = write(PLAIN.replace("stop = 35.0", "stop = -1").replace("level = 4.0", "levle = 4.0"))
    assert main(["check", file]) == 2
    out = capsys.readouterr().out.splitlines()
    assert out[0].startswith(f"{file}:5: error: [run] stop = -1 s")
    assert out[1].startswith(f'{file}:18: error: [components.voltage]: there is no parameter "lev')
    assert out[2] == f"{file}: 2 errors"
    assert len(out) == 3


def test_warnings_and_notes_do_not_stop(write, capsys):
    file = write(PLAIN.replace("level = 4.0", "level = 9.0"))
    assert main(["check", file]) == 0
    first, last = capsys.readouterr().out.splitlines()
    assert first.startswith(f"{file}:18: warning: damper.voltage = 9 V lies outside 0 to 8 V")
    assert last == f"{file}: ok, 1 warning"


def test_several_files_are_all_checked(write, capsys):
    good, bad = write(PLAIN), write("schema = 1\n[run", "bad.toml")
    assert main(["check", bad, good, "no_damper"]) == 2
    out = capsys.readouterr().out
    assert f"{bad}:2: error: not TOML" in out
    assert f"{good}: ok" in out
    assert "no_damper: ok" in out


def test_overrides_are_checked_with_the_file(write, capsys):
    file = write(PLAIN)
    assert main(["check", file, "--set", "damper.sigma_1=4.5", "--set", "run.step=1e-3"]) == 0
    assert main(["check", file, "--set", "damper.sigma_1=-4.5"]) == 2
    assert f'{file}: error: override "damper.sigma_1": damper.sigma_1' in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check"], "expected a FILE"),
        (["check", "no_damper", "--set", "damper.f_c"], "NAME=VALUE is right"),
        (["check", "no_damper", "--set", "a.b=1", "--set", "a.b=1"], "given twice"),
    ],
)
def test_a_wrong_command_is_one_message(capsys, arguments, words):
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert captured.out == ""
    assert "Traceback" not in captured.err


def test_json_holds_the_same(write, capsys):
    good, bad = write(PLAIN), write(PLAIN.replace("stop = 35.0", "stop = -1"), "bad.toml")
    assert main(["check", good, bad, "nix.toml", "--json"]) == 2
    files = json.loads(capsys.readouterr().out)["files"]
    assert [file["file"] for file in files] == [good, bad, "nix.toml"]
    assert [file["ok"] for file in files] == [True, False, False]
    assert files[0]["findings"] == []
    assert files[1]["findings"][0]["line"] == 5
    assert files[1]["findings"][0]["level"] == "error"
    assert "above 0 s" in files[1]["findings"][0]["text"]
    assert files[2]["findings"][0]["line"] == 0


def test_the_findings_are_coloured_on_a_terminal_only(write, capsys, monkeypatch):
    file = write(PLAIN.replace("stop = 35.0", "stop = -1"))
    main(["check", file])
    assert "\033[" not in capsys.readouterr().out
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    main(["check", file])
    assert "\033[31merror\033[0m" in capsys.readouterr().out


# The schema


def test_the_schema_in_the_repository_is_the_one_that_the_code_makes(capsys):
    assert main(["check", "--schema"]) == 0
    printed = capsys.readouterr().out
    assert printed == schema_text()
    stored = files.scenarios_folder() / "scenario.schema.json"
    assert stored.read_text(encoding="utf-8") == printed, (
        "renew it: bristle check --schema > scenarios/scenario.schema.json"
    )


WRONG = [
    ("schema = 1", "schema = 2"),
    ("stop = 35.0", "stop = -1"),
    ("step = 0.002\n", ""),
    ("[run]", "[runn]"),
    ('"gauss-seidel"', '"euler"'),
    ('fmu = "LuGreDamper"', 'fmu = "LuGre"'),
    ('fmu = "LuGreDamper"', 'fmu = "LuGreDamper"\nstepp = 1'),
    ('fmu = "LuGreDamper"', 'fmu = "LuGreDamper"\nbuilding = "x.toml"'),
    ("level = 4.0", "levle = 4.0"),
    ("level = 4.0", 'level = "4.0"'),
    ("80.0", "-80.0"),
    ("gas_spring.k", "gas_sprng.k"),
    ('"voltage.voltage"', '["voltage.voltage"]'),
    ('"voltage.voltage"', '{ from = "voltage.voltage", factr = 2.0 }'),
]
RIGHT = [
    ("", ""),
    ('"gas_spring.on" = true, "gas_spring.k"', "gas_spring.on = true, gas_spring.k"),
    ('"structure.damper_force"', "structure.damper_force"),
    ('"voltage.voltage"', '{ from = "voltage.voltage", factor = 2.0 }'),
    ('fmu = "Structure"', 'fmu = "Structure"\nbuilding = "house.toml"'),
    ('fmu = "Structure"', 'fmu = "../Mine.fmu"\nparameters = { anything = 1 }'),
]


@pytest.fixture(scope="module")
def validator():
    import jsonschema

    schema = build_schema()
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema)


def data(old, new):
    import tomllib

    assert old in VALID
    return tomllib.loads(VALID.replace(old, new))


@pytest.mark.parametrize(("old", "new"), RIGHT)
def test_an_editor_takes_what_is_right(validator, old, new):
    assert list(validator.iter_errors(data(old, new))) == []


@pytest.mark.parametrize(("old", "new"), WRONG)
def test_an_editor_marks_what_is_wrong(validator, old, new):
    assert list(validator.iter_errors(data(old, new)))


def test_an_editor_takes_every_stock_scenario(validator):
    import tomllib

    from bristle.system.scenario import stock_scenarios

    for file in stock_scenarios():
        errors = list(validator.iter_errors(tomllib.loads(file.read_text(encoding="utf-8"))))
        assert errors == [], file
        assert file.read_text(encoding="utf-8").startswith("#:schema ./scenario.schema.json\n")
