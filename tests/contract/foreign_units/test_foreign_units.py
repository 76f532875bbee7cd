"""Units of other people's FMUs are what their BaseUnits say, whatever they are called."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from described import component, connection, port, unit, write_fmu, write_scenario, write_ssp

from bristle.cli import main
from bristle.system.scenario import load_scenario

NEWTON = 'kg="1" m="1" s="-2"'
JOULE = 'kg="1" m="2" s="-2"'
Pair = Callable[..., tuple[Path, Path]]

# Output's unit and BaseUnit, input's; what the input gets of a value: factor, offset.
SAME = {
    "Newton": (("Newton", NEWTON), ("N", NEWTON)),
    "mN that is a moment": (("mN", JOULE), ("J", JOULE)),
    "an own name for both": (("Kraft", NEWTON), ("force", NEWTON)),
    "by its name alone": (("N", None), ("Newton", NEWTON)),
    "no BaseUnit at all": (("N.m", None), ("N m", None)),
    "unknown here, and the same": (("furlong", None), ("furlong", None)),
    "fewer digits": (
        ("deg", 'rad="1" factor="0.0174532925"'), ("grad", 'rad="1" factor="0.01745329252"')
    ),
    "an angle without a dimension": (("rad/s", 's="-1"'), ("rad/s", 's="-1" rad="1"')),
}  # fmt: skip
CONVERTED = {
    "rpm": (("rpm", 's="-1" rad="1" factor="0.10471975511965977"'),
            ("rad/s", 's="-1" rad="1"'), 0.10471975511965977, 0.0),
    "g of a balance": (("g", 'kg="1" factor="0.001"'), ("kg", 'kg="1"'), 1e-3, 0.0),
    "g of gravity": (("acc", 'm="1" s="-2" factor="9.80665"'), ("m/s2", None), 9.80665, 0.0),
    "kN into N": (("kN", NEWTON + ' factor="1000"'), ("N", NEWTON), 1e3, 0.0),
    "N into kilonewton": (("N", None), ("kilonewton", NEWTON + ' factor="1000"'), 1e-3, 0.0),
    "kPa into bar": (("kPa", 'kg="1" m="-1" s="-2" factor="1e3"'),
                     ("Bar", 'kg="1" m="-1" s="-2" factor="1e5"'), 1e-2, 0.0),
    "degree into rad": (("degree", 'rad="1" factor="0.017453292519943295"'),
                        ("rad", 'rad="1"'), 0.017453292519943295, 0.0),
    "degF into K": (("degF", 'K="1" factor="0.5555555555555556" offset="255.3722222222222"'),
                    ("K", 'K="1"'), 5.0 / 9.0, 255.3722222222222),
    "K into Celsius": (("K", None), ("Celsius", 'K="1" offset="273.15"'), 1.0, -273.15),
}  # fmt: skip
OTHER = {
    "Newton into m": (("Newton", NEWTON), ("m", None)),
    "mN that is a moment into N": (("mN", JOULE), ("N", NEWTON)),
    "g of gravity into g of a balance": (
        ("g", 'm="1" s="-2" factor="9.80665"'), ("g", 'kg="1" factor="0.001"')
    ),
    "one name, two quantities": (("torque", JOULE), ("torque", NEWTON)),
    "Hz into rad/s": (("Hz", 's="-1"'), ("rad/s", 's="-1" rad="1"')),
}  # fmt: skip


@pytest.fixture(params=["2.0", "3.0"])
def pair(request: pytest.FixtureRequest, tmp_path: Path) -> Pair:
    """Return a function that writes an FMU with an output y, and one with an input u."""
    version = request.param

    def write(
        given: tuple[str, str | None],
        wanted: tuple[str, str | None],
        more: tuple[str, str] = ("", ""),
    ) -> tuple[Path, Path]:
        files = []
        ends = (("a", "y", "output", given), ("b", "u", "input", wanted))
        for (name, variable, causality, told), attributes in zip(ends, more, strict=True):
            text = f'unit="{told[0]}" {attributes}'
            ports = port(0, variable, causality, more=text, version=version)
            file = tmp_path / f"{name}.fmu"
            files.append(write_fmu(file, ports, units=unit(*told), version=version))
        return files[0], files[1]

    return write


def check(file: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, list[dict[str, str]]]:
    """Return exit code and findings of `bristle check`."""
    code = main(["check", "--json", str(file)])
    return code, json.loads(capsys.readouterr().out)["files"][0]["findings"]


def joined(folder: Path, fmus: tuple[Path, Path], wire: str = '"b.u" = "a.y"') -> Path:
    return write_scenario(folder / "joined.toml", {"a": (fmus[0], ""), "b": (fmus[1], "")}, wire)


def packed(folder: Path, fmus: tuple[Path, Path]) -> Path:
    body = f"<d:Elements>{component('a')}{component('b')}</d:Elements>"
    wires = f"<d:Connections>{connection('a.y', 'b.u')}</d:Connections>"
    return write_ssp(folder / "packed.ssp", body + wires, dict(zip("ab", fmus, strict=True)))


@pytest.mark.parametrize("case", SAME)
def test_units_that_mean_the_same_are_joined(
    case: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fmus = pair(*SAME[case])
    code, found = check(joined(tmp_path, fmus), capsys)
    assert code == 0
    assert [one["level"] for one in found] == (["note"] if "angle" in case else [])
    assert main(["import-ssp", str(packed(tmp_path, fmus)), "-o", str(tmp_path / "out")]) == 0
    (wire,) = load_scenario(tmp_path / "out" / "packed.toml").wires
    assert (wire.factor, wire.offset, wire.transformed) == (1.0, 0.0, False)


@pytest.mark.parametrize("case", CONVERTED)
def test_the_same_quantity_in_another_unit_is_refused_with_the_factor_and_packages_convert_it(
    case: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given, wanted, factor, offset = CONVERTED[case]
    fmus = pair(given, wanted)
    code, (finding,) = check(joined(tmp_path, fmus), capsys)
    assert (code, finding["level"]) == (2, "error")
    assert "the same quantity in another unit" in finding["text"]
    advice = re.search(r"\{ from = .*? \}", finding["text"])
    assert advice is not None
    scenario = load_scenario(joined(tmp_path, fmus, f'"b.u" = {advice[0]}'))
    said = scenario.wires[0]
    assert (said.factor, said.offset) == (pytest.approx(factor), pytest.approx(offset))
    assert main(["import-ssp", str(packed(tmp_path, fmus)), "-o", str(tmp_path / "out")]) == 0
    (wire,) = load_scenario(tmp_path / "out" / "packed.toml").wires
    assert wire.factor == pytest.approx(factor, rel=1e-12)
    assert wire.offset == pytest.approx(offset, rel=1e-12)


@pytest.mark.parametrize("case", OTHER)
def test_another_quantity_is_refused_whatever_the_names(
    case: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fmus = pair(*OTHER[case])
    code, (finding,) = check(joined(tmp_path, fmus), capsys)
    assert (code, finding["level"]) == (2, "error")
    assert "another quantity" in finding["text"]
    assert main(["import-ssp", str(packed(tmp_path, fmus)), "-o", str(tmp_path / "out")]) == 2
    assert "does not convert into" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_difference_of_temperatures_has_no_offset(
    pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    celsius, kelvin = ("degC", 'K="1" offset="273.15"'), ("K", 'K="1"')
    difference = ('relativeQuantity="true"', 'relativeQuantity="true"')
    assert check(joined(tmp_path, pair(celsius, kelvin, difference)), capsys) == (0, [])
    code, (finding,) = check(joined(tmp_path, pair(celsius, celsius, (difference[0], ""))), capsys)
    assert code == 2
    assert "[degC] (defined as 1 K)" in finding["text"]


def test_an_fmu_that_defines_a_unit_twice_is_refused_in_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ports = port(0, "y", "output", more='unit="N"')
    twice = write_fmu(tmp_path / "a.fmu", ports, units=unit("N", NEWTON) + unit("N", JOULE))
    words = 'unit "N" is defined twice: as 1 kg.m/s2 and as 1 kg.m2/s2; one definition is right.'
    code, (finding,) = check(write_scenario(tmp_path / "a.toml", {"a": (twice, "")}), capsys)
    assert code == 2
    assert words in finding["text"]
    body = f"<d:Elements>{component('a')}</d:Elements>"
    package = write_ssp(tmp_path / "a.ssp", body, {"a": twice})
    for command in (["run", str(tmp_path / "a.toml")], ["import-ssp", str(package)],
                    ["run", str(package)]):  # fmt: skip
        assert main(command) == 2
        error = capsys.readouterr().err
        assert words in error
        assert len(error.splitlines()) == 1
    equal = write_fmu(tmp_path / "a.fmu", ports, units=unit("N", NEWTON) + unit("N", NEWTON))
    assert check(write_scenario(tmp_path / "b.toml", {"a": (equal, "")}), capsys) == (0, [])


@pytest.mark.parametrize(
    ("base", "words"),
    [('m="1" factor="0"', "its factor is 0"), ('m="0.5"', "powers of base units are whole"),
     ('m="one"', 'm = "one" is no finite number'),
     ('factor="nan"', 'factor = "nan" is no finite number')],
)  # fmt: skip
def test_a_base_unit_that_is_none_is_refused(
    base: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fmu = write_fmu(tmp_path / "a.fmu", port(0, "y", "output"), units=unit("my", base))
    code, (finding,) = check(write_scenario(tmp_path / "a.toml", {"a": (fmu, "")}), capsys)
    assert code == 2
    assert f'unit "my": {words}' in finding["text"]


def test_a_package_declares_units_as_their_fmus_define_them(
    pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And leaves out a name that two FMUs use for two units: each FMU says its own."""
    target = tmp_path / "out.ssp"
    wire = '"b.u" = { from = "a.y", factor = 2.0 }'
    for given, wanted, declared in (
        (("mN", JOULE), ("my", NEWTON + ' factor="5"'), {"mN": JOULE, "my": 'factor="5.0"'}),
        (("mN", JOULE), ("mN", None), {}),
    ):
        file = joined(tmp_path, pair(given, wanted), wire)
        assert main(["export-ssp", str(file), "-o", str(target), "--no-coupling-error"]) == 0
        with zipfile.ZipFile(target) as archive:
            text = archive.read("SystemStructure.ssd").decode()
        found = dict(re.findall(r'<ssc:Unit name="(\w+)">\s*<ssc:BaseUnit ([^/]*)', text))
        assert found.keys() == declared.keys()
        for name, base in declared.items():
            assert base in found[name]
    capsys.readouterr()


def test_a_parameter_of_a_package_is_converted_into_what_the_fmu_defines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A name that the package uses and does not define means what the FMU says it means."""
    ports = port(0, "m", "input", more='unit="g"') + port(1, "p", "input", more='unit="mN"')
    units = unit("g", 'kg="1" factor="0.001"') + unit("mN", JOULE)
    fmu = write_fmu(tmp_path / "a.fmu", ports, units=units)
    given = '<v:Parameter name="{}"><v:Real value="3" unit="{}"/></v:Parameter>'
    values = "".join(given.format(*one) for one in (("m", "kg"), ("p", "mN")))
    bound = (
        "<d:ParameterBindings><d:ParameterBinding><d:ParameterValues><v:ParameterSet>"
        f"<v:Parameters>{values}</v:Parameters></v:ParameterSet></d:ParameterValues>"
        "</d:ParameterBinding></d:ParameterBindings>"
    )
    body = f"<d:Elements>{component('a', bound)}</d:Elements>"
    package = write_ssp(tmp_path / "a.ssp", body, {"a": fmu})
    assert main(["import-ssp", str(package), "-o", str(tmp_path / "out")]) == 0
    found = load_scenario(tmp_path / "out" / "a.toml").components["a"].values
    assert found == {"m": pytest.approx(3000.0), "p": 3.0}


def test_units_convert_through_nested_systems_and_a_package_that_contradicts_its_fmu_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mm = unit("mm", 'm="1" factor="0.001"')
    a = write_fmu(tmp_path / "a.fmu", port(0, "y", "output", more='unit="mm"'), units=mm)
    b = write_fmu(tmp_path / "b.fmu", port(0, "u", "input", more='unit="Meter"'),
                  units=unit("Meter", 'm="1"'))  # fmt: skip
    joint = '<d:Connector name="x" kind="input"><c:Real unit="cm"/></d:Connector>'
    inner = (
        f'<d:System name="rig"><d:Connectors>{joint}</d:Connectors><d:Elements>{component("b")}'
        f"</d:Elements><d:Connections>{connection('x', 'b.u')}</d:Connections></d:System>"
    )
    wires = f"<d:Connections>{connection('a.y', 'rig.x')}</d:Connections>"
    for told, factor, notes in (("", 1e-3, 0), ("cm", 1e-2, 1)):
        port_of_a = f'<d:Connector name="y" kind="output"><c:Real unit="{told}"/></d:Connector>'
        first = component("a", f"<d:Connectors>{port_of_a}</d:Connectors>" if told else "")
        body = f"<d:Elements>{first}{inner}</d:Elements>{wires}"
        units = '<c:Unit name="cm"><c:BaseUnit m="1" factor="0.01"/></c:Unit>'
        package = write_ssp(tmp_path / f"n{told}.ssp", body, {"a": a, "b": b}, units=units)
        assert main(["import-ssp", str(package), "-o", str(tmp_path / f"out{told}")]) == 0
        said = capsys.readouterr().out
        assert said.count('the connector "y" is in [cm], in its FMU in [mm]') == notes
        (wire,) = load_scenario(tmp_path / f"out{told}" / f"n{told}.toml").wires
        assert wire.factor == pytest.approx(factor, rel=1e-12)
