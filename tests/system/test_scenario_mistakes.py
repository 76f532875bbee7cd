"""Every mistake that a scenario file can hold: found, on its line, with what would be right."""

import tomllib
from random import Random

import pytest
from described import port, write_fmu
from valid import VALID

from bristle.errors import ScenarioError
from bristle.system.scenario import check_scenario, load_scenario

DAMPER = 'fmu = "LuGreDamper"'
PARAMETERS = 'parameters = { "gas_spring.on" = true, "gas_spring.k" = 80.0 }'


@pytest.fixture
def findings(tmp_path):
    """Write a text and check it: (errors as `LINE: text`, the text's lines)."""

    def of(text, level="error"):
        file = tmp_path / "my.toml"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        before = sorted(tmp_path.iterdir())
        found = check_scenario(file)
        assert sorted(tmp_path.iterdir()) == before  # a check writes nothing
        return [finding for finding in found if finding.level == level]

    return of


def where(text, mark):
    """Return the number of the line that holds a mark."""
    return next(n for n, line in enumerate(text.splitlines(), 1) if mark in line)


# (what, text of the valid file, what stands there instead, the mark of the line, words)
MISTAKES = [
    # the file's own keys
    ("run missing", "[run]\nstop = 35.0\nstep = 0.002\nalgorithm = \"gauss-seidel\"\n", "", None,
     ["[run] stop is missing"]),
    ("run no table", "[run]\nstop = 35.0\nstep = 0.002\nalgorithm = \"gauss-seidel\"", "run = 3",
     "run = 3", ["run is 3: expected a table"]),
    ("unknown key of the run", "step = 0.002", "step = 0.002\ntolerance = 1", "tolerance",
     ['[run]: there is no key "tolerance"', "stop, step, algorithm"]),
    # times
    ("step missing", "step = 0.002\n", "", "[run]", ["[run] step is missing"]),
    ("stop zero", "stop = 35.0", "stop = 0.0", "stop", ["stop = 0 s", "above 0 s"]),
    ("stop nan", "stop = 35.0", "stop = nan", "stop", ["nan, not a finite number"]),
    ("stop a date", "stop = 35.0", "stop = 2020-01-01", "stop", ["not a number"]),
    ("stop beyond float", "stop = 35.0", "stop = 1" + 400 * "0", "stop", ["beyond all bounds"]),
    ("stop no whole number of steps", "stop = 35.0", "stop = 35.001", "stop",
     ["17500.5", "stop = 35 or 35.002."]),
    ("step does not fit", "step = 0.002", "step = 0.003", "stop", ["stop = 34.998 or 35.001."]),
    ("stop shorter than a step", "stop = 35.0", "stop = 0.001", "stop", ["stop = 0.002."]),
    ("too many steps", "step = 0.002", "step = 1e-9", "step =",
     ["3.5e+10 steps", "GB of results", "a step from"]),
    ("steps beyond counting", "step = 0.002", "step = 1e-320", "step =", ["inf steps"]),
    ("algorithm unlike any", '"gauss-seidel"', '"euler"', "algorithm",
     ["There are: gauss-seidel, midpoint, midpoint-iterated, jacobi."]),
    # components
    ("components no table", VALID[VALID.index("[components.ground]"):], "[[components]]\n",
     "components", ["is a list: expected a table"]),
    ("no components", VALID[VALID.index("[components.ground]"):], "[components]\n", "components",
     ["no components", "[components.NAME]"]),
    ("component no table", "[connections]", "[components]\nx = 1\n[connections]", "x = 1",
     ["x is 1: expected a table"]),
    ("component with a dot", "[connections]",
     '[components."a.b"]\nfmu = "Structure"\nparameters = { ground_acceleration = 0, '
     "damper_force = 0 }\n[connections]", '"a.b"', ["cannot be called so"]),
    ("component called run", "[connections]",
     '[components.run]\nfmu = "ConstantVoltage"\n[connections]', "[components.run]",
     ["cannot be called so"]),
    ("component with no name", "[connections]",
     '[components.""]\nfmu = "ConstantVoltage"\n[connections]', '""', ["cannot be called so"]),
    ("fmu missing", f"{DAMPER}\n", "", "[components.damper]", ["fmu is missing"]),
    ("fmu empty", DAMPER, 'fmu = ""', 'fmu = ""', ["a built-in name or the path"]),
    ("unknown built-in", DAMPER, 'fmu = "LugreDampr"', "LugreDampr",
     ['no built-in FMU "LugreDampr"', 'Did you mean "LuGreDamper"?']),
    ("no such FMU file", DAMPER, 'fmu = "my/own.fmu"', "my/own.fmu", ['no file "my/own.fmu"']),
    ("FMU file with a null", DAMPER, 'fmu = "a\\u0000.fmu"', "a\\u0000", ["null character"]),
    ("unknown key of a component", DAMPER, f"{DAMPER}\nstepp = 1", "stepp",
     ['no key "stepp"', 'Did you mean "step"?']),
    ("parameter beside its table", DAMPER, f"{DAMPER}\nsigma_1 = 4.0", "sigma_1",
     ['"sigma_1" belongs into its parameters']),
    ("building of a damper", DAMPER, f'{DAMPER}\nbuilding = "my.toml"', "building",
     ['only the built-in "Structure"']),
    ("building not there", 'fmu = "Structure"', 'fmu = "Structure"\nbuilding = "hous.toml"',
     "building", ['no file "hous.toml"']),
    ("building a number", 'fmu = "Structure"', 'fmu = "Structure"\nbuilding = 2', "building",
     ["building is 2: expected a text"]),
    # a component's own step
    ("component step does not divide", DAMPER, f"{DAMPER}\nstep = 0.0015", "0.0015",
     ["does not divide", "0.002 or 0.001"]),
    ("component step longer than the run's", DAMPER, f"{DAMPER}\nstep = 0.004", "0.004",
     ["does not divide", "0.002 or 0.001"]),
    ("component step negative", DAMPER, f"{DAMPER}\nstep = -0.001", "-0.001",
     ["[components.damper] step = -0.001 s"]),
    ("component step text", DAMPER, f'{DAMPER}\nstep = "0.001"', '"0.001"', ["needs no quotes"]),
    ("component step absurd", DAMPER, f"{DAMPER}\nstep = 1e-12", "1e-12", ["at most 10000"]),
    # parameters
    ("unknown parameter", '"gas_spring.k"', '"gas_sprng.k"', "gas_sprng",
     ['no parameter "gas_sprng.k"', 'Did you mean "gas_spring.k"?']),
    ("parameter of text", '"gas_spring.k" = 80.0', '"gas_spring.k" = "80"', "gas_spring.k",
     ["damper.gas_spring.k is the text", "needs no quotes", "in N/m"]),
    ("parameter true", '"gas_spring.k" = 80.0', '"gas_spring.k" = true', "gas_spring.k",
     ["is true, not a number"]),
    ("parameter inf", '"gas_spring.k" = 80.0', '"gas_spring.k" = inf', "gas_spring.k",
     ["not a finite number"]),
    ("switch a number", '"gas_spring.on" = true', '"gas_spring.on" = 1', "gas_spring.on",
     ["true or false is right"]),
    ("parameter below", '"gas_spring.k" = 80.0', '"gas_spring.k" = -1.0', "gas_spring.k",
     ["-1 N/m lies below 0 N/m", "0 to 1e+06 N/m is right"]),
    ("parameter above", '"gas_spring.k" = 80.0', '"gas_spring.k" = 1e9', "gas_spring.k",
     ["1e+09 N/m lies above 1e+06 N/m"]),
    ("text a number", 'record = "el_centro_1940_ns"', "record = 1940", "record",
     ["record is 1940; a text in quotes is right"]),
    ("text with a null", 'record = "el_centro_1940_ns"', 'record = "a\\u0000"', "record",
     ["null character"]),
    ("unknown record", "el_centro_1940_ns", "northridge.csv", "record",
     ['ground.record: record "northridge.csv"']),
    ("output as parameter", PARAMETERS, "parameters = { force = 1.0 }", "force = 1.0",
     ["damper.force is an output; only parameters and inputs can be set"]),
    ("twice, with and without quotes", PARAMETERS,
     'parameters = { "gas_spring.on" = true, gas_spring.on = true }', "gas_spring.on",
     ["set twice, with and without quotes"]),
    # connections
    ("connections no table", VALID[VALID.index("[connections]"):], "[[connections]]\n",
     "connections", ["is a list: expected a table"]),
    ("source misspelt", "damper.force", "damper.forc", "damper.forc",
     ['no output "forc"', 'Did you mean "force"?']),
    ("target misspelt", '"damper.velocity" =', '"damper.velocty" =', "velocty",
     ['no input "velocty"', 'Did you mean "velocity"?']),
    ("component misspelt", '"voltage.voltage"', '"volts.voltage"', "volts",
     ['no component "volts"', "ground, structure, voltage, damper"]),
    ("no port", '"voltage.voltage"', '"voltage"', '= "voltage"', ['"voltage" is no port']),
    ("empty port", '"voltage.voltage"', '"voltage."', '"voltage."', ["is no port"]),
    ("units differ", '"damper.velocity" = "structure.base_velocity"',
     '"damper.velocity" = "structure.base_displacement"', "damper.velocity",
     ['"damper.velocity" [m/s] is fed by "structure.base_displacement" [m]', "another quantity"]),
    ("output fed by output", '"structure.damper_force" = "damper.force"',
     '"damper.dissipated_energy" = "damper.force"\n"structure.damper_force" = "damper.force"',
     "dissipated_energy",
     ['"damper.dissipated_energy" is an output; an input belongs on the left']),
    ("input fed by input", '"voltage.voltage"', '"structure.extra_force"', "extra_force",
     ['"structure.extra_force" is an input; an output belongs on the right']),
    ("the wrong way round", '"damper.voltage" = "voltage.voltage"',
     '"voltage.voltage" = "damper.voltage"', '"voltage.voltage"',
     ["the wrong way round", '"damper.voltage" = "voltage.voltage"']),
    ("parameter connected", '"damper.voltage" =',
     '"damper.v_max" = "voltage.voltage"\n"damper.voltage" =',
     "v_max", ['"damper.v_max" is a parameter, which cannot be connected']),
    ("two sources in a list", '"voltage.voltage"', '["voltage.voltage", "ground.fault"]',
     '"damper.voltage"', ["an input has one source", "extra_force"]),
    ("factor a text", '"voltage.voltage"', '{ from = "voltage.voltage", factor = "two" }',
     '"damper.voltage"', ['"damper.voltage": factor is the text "two", not a number']),
    ("offset not finite", '"voltage.voltage"', '{ from = "voltage.voltage", offset = inf }',
     '"damper.voltage"', ["offset is inf, not a finite number"]),
    ("transformed from a number", '"voltage.voltage"', "{ from = 3, factor = 2.0 }",
     '"damper.voltage"', ['is fed by 3; "component.output" is right']),
    ("source a number", '"voltage.voltage"', "4.0", '"damper.voltage"', ["is fed by 4.0"]),
    ("connected twice, with and without quotes", '"damper.voltage" =',
     'damper.voltage = "voltage.voltage"\n"damper.voltage" =', '"damper.voltage" =',
     ['"damper.voltage" has two sources']),
    ("connected and set", PARAMETERS, "parameters = { voltage = 2.0 }", '"damper.voltage"',
     ["connected here and set in the parameters of damper"]),
    ("input open", '"damper.voltage" = "voltage.voltage"\n', "", "[components.damper]",
     ['"damper.voltage" [V] has no source', '"damper.voltage" = "voltage.voltage"',
      "or set it in the parameters"]),
    ("holding force without mass", '"damper.voltage" = "voltage.voltage"',
     '"damper.voltage" = "voltage.voltage"\n"damper.holding_force" = "structure.holding_force"',
     "holding_force", ["moving_mass is 0", "in kg"]),
    ("mass without holding force", PARAMETERS, "parameters = { moving_mass = 1.9693563369446 }",
     "moving_mass", ["without holding_force", '"damper.holding_force"']),
    # TOML itself
    ("no TOML", "step = 0.002", "step == 0.002", "step =", ["not TOML", "step == 0.002"]),
    ("decimal comma", "step = 0.002", "step = 0,002", "step =", ["not TOML", "one key = value"]),
    ("umlaut in a table", "[components.damper]", "[components.dämpfer]", "dämpfer",
     ['a name with "ä" needs quotes']),
    ("umlaut in a key", '"damper.voltage" =', "dämpfer.voltage =", "dämpfer",
     ['a name with "ä" needs quotes']),
    ("no quotes", '"gauss-seidel"', "gauss-seidel", "algorithm", ["text needs quotes"]),
    ("broken inline table", '{ "gas_spring.on" = true,', '{ "gas_spring.on" = true,\n',
     "gas_spring.on", ["stays on one line"]),
    ("backslash", "el_centro_1940_ns", "C:\\my\\rec.csv", "record", ["single quotes"]),
    ("key twice", "stop = 35.0", "stop = 35.0\nstop = 36.0", "stop = 36.0",
     ['"run.stop" is written twice, first in line 5']),
    ("component twice", "[connections]", "[components.damper] # again\nfmu = 'x'\n[connections]",
     "# again", ['"components.damper" is written twice, first in line 20']),
    ("connection twice", '"damper.voltage" =',
     '"damper.voltage" = "ground.fault"\n"damper.voltage" =',
     '"voltage.voltage"', ['"connections.damper.voltage" is written twice']),
    ("cut off", VALID[VALID.index('"damper.voltage"'):], '"damper.voltage', '"damper.voltage',
     ["not TOML"]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "mark", "words"), [case[1:] for case in MISTAKES], ids=[c[0] for c in MISTAKES]
)
def test_a_mistake_is_found_on_its_line_with_what_would_be_right(findings, old, new, mark, words):
    assert old in VALID
    text = VALID.replace(old, new, 1)
    errors = findings(text)
    line = where(text, mark) if mark else 0
    told = [f"{error.line}: {error.text}" for error in errors]
    assert any(
        error.line == line and all(word in error.text for word in words) for error in errors
    ), told


@pytest.mark.parametrize(
    ("raw", "line", "words"),
    [
        (VALID.replace("El Centro", "Él Centro").encode("latin-1"), 2, "not UTF-8"),
        (b"\0" * 100, 1, "not TOML"),
        (b"", 0, "schema is missing"),
        (VALID.replace("\n", "\r").encode(), 1, "not TOML"),
        (b"\xef\xbb\xbf\xef\xbb\xbf" + VALID.encode(), 1, "not TOML"),
    ],
    ids=["Latin-1", "nulls", "empty", "CR", "two BOMs"],
)
def test_a_file_that_is_no_scenario_is_refused_in_one_finding(findings, raw, line, words):
    found = findings(raw)
    assert words in found[0].text
    assert found[0].line == line


def test_a_folder_and_a_missing_file_are_findings(tmp_path):
    assert "is a folder" in check_scenario(tmp_path)[0].text
    missing = check_scenario(tmp_path / "none.toml")
    assert [finding.level for finding in missing] == ["error"]
    assert "there is no scenario file" in missing[0].text


def test_a_file_that_may_not_be_read_is_a_finding(tmp_path, monkeypatch):
    file = tmp_path / "my.toml"
    file.write_text(VALID)

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)  # root may read anything: chmod is no test
    (finding,) = check_scenario(file)
    assert (finding.line, finding.level) == (0, "error")
    assert finding.text == "cannot be read (Permission denied)."


def test_all_mistakes_of_a_file_are_told_at_once(tmp_path):
    text = VALID
    wrong = [
        ("stop = 35.0", "stop = -1.0"),
        ('"gauss-seidel"', '"gaus-seidel"'),
        ("peak = 5.886", "peek = 5.886"),
        ("level = 4.0", 'level = "4.0"'),
        ('fmu = "Structure"', 'fmu = "Struktur"'),
        ('"gas_spring.k" = 80.0', '"gas_spring.k" = -80.0'),
        ('"damper.voltage" = "voltage.voltage"', '"damper.voltage" = "voltage.level"'),
        ('"damper.velocity" = "structure.base_velocity"\n', ""),
    ]
    for old, new in wrong:
        text = text.replace(old, new)
    file = tmp_path / "my.toml"
    file.write_text(text)
    with pytest.raises(ScenarioError) as raised:
        load_scenario(file)
    told = str(raised.value).splitlines()
    words = [
        "stop = -1",
        "gaus-seidel",
        "peek",
        "Struktur",
        "level",
        '"damper.velocity"',
        "-80",
        '"voltage.level" is a parameter',
    ]
    assert len(told) == len(words)
    lines = []
    for line, word in zip(told, words, strict=True):
        assert line.strip().startswith(f"{file}:")
        assert word in line
        lines.append(int(line.split(":")[1]))
    assert lines == sorted(lines)


def test_one_mistake_is_one_line(tmp_path):
    file = tmp_path / "my.toml"
    file.write_text(VALID.replace("level", "levle"))
    with pytest.raises(ScenarioError) as raised:
        load_scenario(file)
    assert str(raised.value) == (
        f'{file}:18: [components.voltage]: there is no parameter "levle". '
        'Did you mean "level"? There are: level.'
    )


WITHOUT_RUN = "run = 1\n" + VALID.replace(
    VALID[VALID.index("[run]") : VALID.index("[components")], ""
)
WITHOUT_CONNECTIONS = "connections = 1\n" + VALID[: VALID.index("[connections]")]


@pytest.mark.parametrize(
    "text",
    [
        VALID.replace(DAMPER, 'fmu = "Dampr"'),
        VALID.replace('"damper.velocity" =', '"damper.velocty" ='),
        VALID.replace(
            '"damper.voltage" = "voltage.voltage"', '"voltage.voltage" = "damper.voltage"'
        ),
        WITHOUT_RUN,
    ],
    ids=["component", "misspelt", "wrong way round", "run"],
)
def test_what_follows_from_a_mistake_is_not_told_again(findings, text):
    assert len(findings(text)) == 1


def test_connections_that_are_no_table_are_told_once(findings):
    assert [error.text for error in findings(WITHOUT_CONNECTIONS)] == [
        "connections is 1: expected a table."
    ]


def test_a_wrong_building_is_named_with_its_file(findings, tmp_path):
    (tmp_path / "wrong.toml").write_text("schema = 1\nmasses = [-1.0]\nstiffnesses = [1.0]\n")
    text = VALID.replace('fmu = "Structure"', 'fmu = "Structure"\nbuilding = "wrong.toml"')
    (error,) = findings(text)
    assert error.line == where(text, "building")
    assert str(tmp_path / "wrong.toml") in error.text
    assert "must be positive" in error.text


def test_a_building_of_another_name_is_suggested(findings, tmp_path):
    (tmp_path / "house.toml").write_text("schema = 1\nmasses = [-1.0]\nstiffnesses = [1.0]\n")
    text = VALID.replace('fmu = "Structure"', 'fmu = "Structure"\nbuilding = "hous.toml"')
    assert 'Did you mean "house.toml"?' in findings(text)[0].text


TOKENS = """[ [[ ] { } = . , " ' \"\"\" # 1 -1 1e400 nan true [] {} "" a.b run damper é \\ \0"""


def test_no_damage_to_a_file_breaks_the_check(findings):
    """What is no TOML is one finding with its line; the rest is checked to the end."""
    for seed in range(200):
        random = Random(seed)
        text = VALID
        for _ in range(random.randint(1, 3)):
            at = random.randrange(len(text))
            cut = random.choice((0, 0, 1, 5))
            text = text[:at] + random.choice([*TOKENS.split(" "), "\n"]) + text[at + cut :]
        lines = [error.line for error in findings(text)]
        last = len(text.splitlines())
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError:
            assert len(lines) == 1, seed
            assert 1 <= lines[0] <= last + 1, seed
        else:
            assert lines == sorted(lines), seed
            assert all(0 <= line <= last for line in lines), seed


# Signals

SIGNAL = 'fmu = "SignalSource"\nparameters = { KEYS }'


def with_signal(keys):
    text = VALID.replace(
        'fmu = "ConstantVoltage"\nparameters = { level = 4.0 }', SIGNAL.replace("KEYS", keys)
    )
    return text.replace('"voltage.voltage"', '"voltage.value"')


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('kind = "sin"', 'voltage.kind = "sin"; Did you mean "sine"? There are: constant, sine'),
        ("kind = 1", "voltage.kind is 1; a text in quotes is right"),
        ('kind = "csv"', 'voltage.file is missing: kind = "csv" reads a file'),
        ('kind = "csv", file = "nix.csv"', 'voltage.file: there is no file "nix.csv"'),
        ('kind = "csv", file = "bad.csv"', "bad.csv"),
        ('kind = "csv", file = "mV.csv"', "[V] is fed by; [mV]; factor = 0.001 }"),
        ('kind = "steps", steps = "0:0 1"', 'voltage.steps: "1" is not TIME:VALUE'),
        ('kind = "steps", steps = "0:0 0:1"', "voltage.steps: the time 0 s does not follow 0 s"),
        ('kind = "steps", steps = ""', "voltage.steps: no pair"),
    ],
)  # fmt: skip
def test_wrong_signals(findings, tmp_path, keys, words):
    (tmp_path / "bad.csv").write_text("time [s],value\n0,0\n1,one\n")
    (tmp_path / "mV.csv").write_text("time [s],value [mV]\n0,0\n1,1000\n")
    text = with_signal(keys)
    errors = findings(text)
    assert len(errors) == 1
    for word in words.split("; "):
        assert word in errors[0].text
    of_wire = '"damper.voltage"' if "mV" in keys else "parameters = { " + keys
    assert errors[0].line == where(text, of_wire)


@pytest.mark.parametrize(
    ("seed", "words"),
    [
        ("1.0", "is 1.0; a whole number is right"),
        ("-1", "= -1 lies below 0"),
        ("4294967296", "FMI holds whole numbers from -2147483648 to 2147483647"),
        ("true", "is true; a whole number is right"),
    ],
)
def test_a_wrong_whole_number(findings, seed, words):
    sensors = f'[components.s]\nfmu = "Sensors"\nparameters = {{ seed = {seed} }}\n\n'
    errors = findings(VALID.replace("[connections]", sensors + "[connections]"))
    assert [words in error.text for error in errors if "s.seed" in error.text] == [True]


def test_a_right_signal_leaves_one_note_on_its_unit(findings, tmp_path):
    (tmp_path / "signal.csv").write_text("time [s],value\n0,0\n1,4\n2,0\n")
    (tmp_path / "volts.csv").write_text("time [s],value [V]\n0,0\n1,4\n2,0\n")
    assert findings(with_signal('kind = "csv", file = "volts.csv"'), "note") == []
    for keys in ('kind = "csv", file = "signal.csv"', 'kind = "steps", steps = "0:0 1:2.5 3:4"'):
        assert findings(with_signal(keys)) == []
        (note,) = findings(with_signal(keys), "note")
        assert note.text == '"voltage.value" has no unit; "damper.voltage" takes its values as [V].'


# Foreign FMUs


@pytest.fixture
def foreign(findings, tmp_path):
    def of(name, level="error", extra="", unit="N", once="false"):
        ports = [port(0, "force", "output", more=f'unit="{unit}"')]
        ports += [port(1, "u", "input")] if "mine.u" in extra else []
        claims = f'canBeInstantiatedOnlyOncePerProcess="{once}"'
        write_fmu(tmp_path / name, "".join(ports), claims=claims)
        text = VALID.replace(
            "[connections]", f'[components.mine]\nfmu = "./{name}"\n\n[connections]\n{extra}'
        )
        return [finding.text for finding in findings(text, level)]

    return of


SPRING = 'parameters = { "gas_spring.on" = true, "gas_spring.k" = 80.0 }'
FORCE = '"structure.extra_force" = "mine.force"\n'


def test_an_fmu_that_cannot_be_opened_is_named(findings, tmp_path):
    (tmp_path / "broken.fmu").write_text("no FMU")
    (error,) = findings(VALID.replace('"LuGreDamper"', '"./broken.fmu"').replace(SPRING, ""))
    assert "[components.damper]" in error.text
    assert "not a zip file" in error.text


def test_another_unit_of_the_same_quantity_is_refused(foreign):
    (error,) = foreign("my.fmu", extra=FORCE, unit="kN")
    assert '"structure.extra_force" [N] is fed by "mine.force" [kN]' in error
    assert "nothing converts it" in error


def test_an_unknown_unit_is_a_warning(foreign):
    assert foreign("my.fmu", extra=FORCE, unit="furlong") == []
    (warning,) = foreign("my.fmu", "warning", extra=FORCE, unit="furlong")
    assert '"furlong" is not known here' in warning


def test_an_input_without_unit_takes_anything_and_says_so(foreign):
    extra = '"mine.u" = "damper.force"\n'
    assert foreign("my.fmu", extra=extra) == []
    assert foreign("my.fmu", "note", extra=extra) == [
        '"mine.u" names no unit; it takes "damper.force" in [N] as it comes.'
    ]


@pytest.mark.parametrize("once", ["true", "1"])
def test_an_fmu_that_lives_once_cannot_be_two_components(foreign, once):
    again = '"structure.extra_force" = "mine.force"\n[components.twin]\nfmu = "my.fmu"\n[x]\n'
    errors = foreign("my.fmu", extra=again, once=once)
    assert any("my.fmu allows one instance per process" in error for error in errors)
