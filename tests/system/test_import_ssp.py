"""SSP packages read: flattened, converted, refused with file and element; foreign ones run."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from bristle.errors import ScenarioError
from bristle.fmu.build import ensure
from bristle.system.model import System
from bristle.system.scenario import check_scenario, load_scenario
from bristle.system.ssp_import import import_ssp
from bristle.system.ssp_read import convert, open_package, read_structure
from bristle.system.toml import scenario_text
from bristle.units import Measure, parse

FOREIGN = Path(__file__).parents[2].parent / "shared" / "fmi" / "ssp"
HEAD = (
    '<a:SystemStructureDescription xmlns:a="http://ssp-standard.org/SSP1/'
    'SystemStructureDescription" xmlns:c="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:v="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:m="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" '
    'name="bench" version="{version}">'
)
UNITS = (
    '<a:Units><c:Unit name="mm"><c:BaseUnit m="1" factor="0.001"/></c:Unit>'
    '<c:Unit name="metre"><c:BaseUnit m="1"/></c:Unit>'
    '<c:Unit name="volt"><c:BaseUnit kg="1" m="2" s="-3" A="-1"/></c:Unit></a:Units>'
)
END = '<a:DefaultExperiment startTime="0" stopTime="0.1"/></a:SystemStructureDescription>'
MOTION = '<a:Component name="motion" source="resources/motion.fmu"/>'
DAMPER = '<a:Component name="damper" source="resources/damper.fmu"/>'


def connect(start: str, end: str, inner: str = "", more: str = "") -> str:
    def side(name: str, text: str) -> str:
        element, _, connector = text.rpartition(".")
        return (f'{name}Element="{element}" ' if element else "") + f'{name}Connector="{connector}"'

    return f"<a:Connection {side('start', start)} {side('end', end)} {more}>{inner}</a:Connection>"


def connector(name: str, kind: str, unit: str = "") -> str:
    real = f'<c:Real unit="{unit}"/>' if unit else "<c:Real/>"
    return f'<a:Connector name="{name}" kind="{kind}">{real}</a:Connector>'


def system(
    elements: str, connections: str = "", *, connectors: str = "", bindings: str = "",
    name: str = "root",
) -> str:  # fmt: skip
    parts = (
        ("Connectors", connectors), ("ParameterBindings", bindings), ("Elements", elements),
        ("Connections", connections),
    )  # fmt: skip
    inner = "".join(f"<a:{tag}>{text}</a:{tag}>" for tag, text in parts if text)
    return f'<a:System name="{name}">{inner}</a:System>'


def values(*pairs: str) -> str:
    """Return a binding of reals: "name=1.0" or "name=1.0 mm"."""
    texts = []
    for pair in pairs:
        name, _, value = pair.partition("=")
        number, _, unit = value.partition(" ")
        unit = f' unit="{unit}"' if unit else ""
        texts.append(f'<v:Parameter name="{name}"><v:Real value="{number}"{unit}/></v:Parameter>')
    return f'<v:ParameterSet version="1.0"><v:Parameters>{"".join(texts)}</v:Parameters>'


def bound(*pairs: str, prefix: str = "", units: str = UNITS) -> str:
    units = units.replace("a:Units", "v:Units")
    inner = f"<a:ParameterValues>{values(*pairs)}{units}</v:ParameterSet></a:ParameterValues>"
    return f'<a:ParameterBinding prefix="{prefix}">{inner}</a:ParameterBinding>'


class Packer:
    """Writes packages of a motion and a damper."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(
        self, body: str, version: str = "1.0", units: str = UNITS, **members: str | bytes
    ) -> Path:
        """Return a package; `members` by name, dots for __ and slashes for ___."""
        file = self.folder / "bench.ssp"
        with zipfile.ZipFile(file, "w") as archive:
            text = HEAD.format(version=version) + body + units + END
            archive.writestr("SystemStructure.ssd", text)
            archive.write(ensure("PrescribedMotion"), "resources/motion.fmu")
            archive.write(ensure("LuGreDamper"), "resources/damper.fmu")
            for name, content in members.items():
                name = name.replace("___", "/").replace("__", ".")
                archive.writestr(name, content)
        return file

    def load(self, body: str, **members: str | bytes) -> System:
        """Return the scenario of a package."""
        folder = self.folder / "out"
        return load_scenario(import_ssp(self(body, **members), folder).scenario)


@pytest.fixture
def pack(tmp_path: Path) -> Packer:
    return Packer(tmp_path)


def wires(scenario: System) -> dict[str, tuple[str, float, float]]:
    return {
        f"{c.target}.{c.input}": (f"{c.source}.{c.output}", c.factor, c.offset)
        for c in scenario.wires
    }


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_nested_systems_become_components_side_by_side(pack: Packer, version: str) -> None:
    inner = system(
        DAMPER,
        connect("x", "damper.displacement"),
        connectors=connector("x", "input", "mm"),
        name="rig",
    )
    scenario = pack.load(system(MOTION + inner, connect("motion.displacement", "rig.x")))
    assert list(scenario.components) == ["motion", "rig_damper"]
    source, factor, offset = wires(scenario)["rig_damper.displacement"]
    assert source == "motion.displacement"
    assert (factor, offset) == (pytest.approx(1.0), 0.0)  # to mm, and back to m
    assert scenario.stop == 0.1


def test_a_connection_written_backwards_is_turned_round(pack: Packer) -> None:
    scenario = pack.load(
        system(MOTION + DAMPER, connect("damper.displacement", "motion.displacement"))
    )
    assert wires(scenario)["damper.displacement"][0] == "motion.displacement"


def test_linear_transformations_come_on_top_of_units(pack: Packer) -> None:
    change = '<c:LinearTransformation factor="2" offset="3"/>'
    motion = MOTION.replace(
        "/>",
        f"><a:Connectors>{connector('displacement', 'output', 'mm')}</a:Connectors></a:Component>",
    )
    joint = ("motion.displacement", "damper.displacement", change)
    scenario = pack.load(system(motion + DAMPER, connect(*joint)))
    assert wires(scenario)["damper.displacement"][1:] == pytest.approx((0.002, 3.0))
    (pack.folder / "out").rename(pack.folder / "first")
    told = connect(*joint, more='suppressUnitConversion="true"')
    scenario = pack.load(system(motion + DAMPER, told))
    assert wires(scenario)["damper.displacement"][1:] == (2.0, 3.0)
    again = pack.folder / "again.toml"
    again.write_text(scenario_text(scenario))
    assert wires(load_scenario(again)) == wires(scenario)


def test_values_find_their_way_in(pack: Packer) -> None:
    """Outer bindings win over inner ones, later ones over those before; connected ones win most."""
    inner = system(
        DAMPER.replace(
            "/>",
            f"><a:ParameterBindings>{bound('sigma_a=1', 'sigma_0=2.5')}</a:ParameterBindings>"
            "</a:Component>",
        ),
        connect("held", "damper.displacement"),
        connectors=connector("held", "input", "mm"),
        name="rig",
    )
    top = bound("rig.damper.sigma_a=2") + bound(
        "damper.sigma_a=4", "x=30 mm", "nobody=1", prefix="rig."
    )
    scenario = pack.load(
        system(
            MOTION + inner,
            connect("x", "rig.held"),
            connectors=connector("x", "input", "metre"),
            bindings=top.replace("rig.x", "x") + bound("x=30 mm"),
        )
    )
    found = scenario.components["rig_damper"].values
    assert (found["sigma_a"], found["sigma_0"]) == (4.0, 2.5)
    assert found["displacement"] == pytest.approx(0.03)
    assert "nobody" in (pack.folder / "out" / "bench.toml").read_text()


def test_sets_and_mappings_in_files(pack: Packer) -> None:
    binding = (
        '<a:ParameterBinding source="resources/p.ssv">'
        '<a:ParameterMapping source="resources/p.ssm"/></a:ParameterBinding>'
    )
    mapping = (
        '<m:ParameterMapping xmlns:m="urn:m" xmlns:c="urn:c" version="1.0">'
        '<m:MappingEntry source="friction" target="damper.sigma_a">'
        '<c:LinearTransformation factor="4" offset="5"/></m:MappingEntry></m:ParameterMapping>'
    )
    given = values("friction=2", "damper.sigma_0=9").replace(
        'version="1.0"', 'version="1.0" xmlns:v="urn:v"'
    )
    scenario = pack.load(
        system(DAMPER, bindings=binding),
        resources___p__ssv=f"{given}</v:ParameterSet>",
        resources___p__ssm=mapping,
    )
    found = scenario.components["damper"].values
    assert found["sigma_a"] == 13.0
    assert "sigma_0" not in found  # what a mapping does not name is left aside


def test_a_package_in_a_package(pack: Packer) -> None:
    inner = HEAD.format(version="1.0") + system(
        DAMPER.replace("resources/", "../resources/"),
        connect("x", "damper.displacement"),
        connectors=connector("x", "input"),
    )
    part = '<a:Component name="part" type="application/x-ssp-definition" source="sub/part.ssd"/>'
    scenario = pack.load(
        system(MOTION + part, connect("motion.displacement", "part.x")),
        sub___part__ssd=inner + UNITS + END,
    )
    assert wires(scenario)["part_damper.displacement"][0] == "motion.displacement"


def test_units_convert_with_factor_and_offset() -> None:
    celsius, kelvin = (Measure(name, parse(name)) for name in ("degC", "K"))
    assert convert(celsius, kelvin) == pytest.approx((1.0, 273.15))
    assert convert(kelvin, celsius) == pytest.approx((1.0, -273.15))
    assert convert(None, celsius) == (1.0, 0.0)


SELF = '<a:Component name="a" type="application/x-ssp-definition" source="SystemStructure.ssd"/>'
LOOP = system(
    "", connect("x", "y"), connectors=connector("x", "input") + connector("y", "output"), name="{}"
)
BAD = {
    "no FMU": (system(""), "nothing to run"),
    "an FMU that is missing": (
        system(DAMPER.replace("damper.fmu", "no.fmu")), "not in the package"
    ),
    "a source outside": (system(DAMPER.replace("resources", "../..")), "leaves the package"),
    "a source elsewhere": (system(DAMPER.replace("resources", "http://x/y")), "not inside"),
    "no source": (system('<a:Component name="damper"/>'), "has no source"),
    "a connector that the FMU lacks": (
        system(DAMPER.replace(
            "/>", f"><a:Connectors>{connector('colour', 'input')}</a:Connectors></a:Component>"
        )),
        '"colour", which its FMU',
    ),
    "a port that the FMU lacks": (
        system(MOTION + DAMPER, connect("motion.colour", "damper.displacement")),
        'no variable "colour"',
    ),
    "an element that is not there": (
        system(DAMPER, connect("other.x", "damper.displacement")), 'no element "other"'
    ),
    "a connector that a system lacks": (
        system(DAMPER, connect("x", "damper.displacement")), 'no connector "x"'
    ),
    "two connections to one input": (
        system(MOTION + DAMPER, 2 * connect("motion.displacement", "damper.displacement")),
        "fed twice",
    ),
    "two outputs": (
        system(MOTION + DAMPER, connect("motion.displacement", "damper.force")), "two that give"
    ),
    "units that do not convert": (
        system(MOTION + DAMPER, connect("motion.displacement", "damper.voltage")),
        "[m] does not convert into [V]",
    ),
    "a unit that nobody knows": (
        system(MOTION.replace("/>", f"><a:Connectors>{connector('displacement', 'output', 'ell')}"
               "</a:Connectors></a:Component>") + DAMPER,
               connect("motion.displacement", "damper.displacement")),
        '"ell" is',
    ),
    "a system in itself": (system(SELF), "contains itself: SystemStructure.ssd -> "),
    "connections in a circle": (
        system(
            DAMPER + LOOP.format("p") + LOOP.format("q"),
            connect("p.y", "q.x") + connect("q.y", "p.x") + connect("p.y", "damper.displacement"),
        ),
        "in a circle",
    ),
    "a signal dictionary": (
        system('<a:SignalDictionaryReference name="bus" dictionary="d"/>' + DAMPER),
        "signal dictionaries are not read",
    ),
    "a mapping that is not linear": (
        system(MOTION + DAMPER, connect(
            "motion.displacement", "damper.displacement", "<c:IntegerMappingTransformation/>"
        )),
        "is not read; <LinearTransformation> is",
    ),
    "a factor that is no number": (
        system(MOTION + DAMPER, connect(
            "motion.displacement", "damper.displacement", '<c:LinearTransformation factor="nan"/>'
        )),
        "no finite number",
    ),
    "no co-simulation FMU": (system(DAMPER.replace("damper.fmu", "bad.fmu")), "not a zip file"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_what_is_wrong_is_told_with_file_and_element(what: str, pack: Packer) -> None:
    body, text = BAD[what]
    package = pack(body, resources___bad__fmu=b"no zip")
    with pytest.raises(ScenarioError, match=re.escape(text)) as caught:
        import_ssp(package, pack.folder / "out")
    assert str(caught.value).startswith(f"{package}: ")
    assert "SystemStructure.ssd" in str(caught.value)
    assert caught.value.exit_code == 2
    assert sorted(entry.name for entry in pack.folder.iterdir()) == ["bench.ssp"]
    assert [finding.level for finding in check_scenario(package)] == ["error"]


def test_a_version_that_is_not_read_and_systems_without_end(pack: Packer) -> None:
    with pytest.raises(ScenarioError, match=re.escape('version "3.0"; 1.0 and 2.0')):
        import_ssp(pack(system(DAMPER), version="3.0"), pack.folder / "out")
    deep = DAMPER
    for _ in range(60):
        deep = system(deep)
    with pytest.raises(ScenarioError, match="nested more than"):
        import_ssp(pack(deep), pack.folder / "out")


def test_entities_are_refused(pack: Packer, tmp_path: Path) -> None:
    file = tmp_path / "bench.ssp"
    with zipfile.ZipFile(file, "w") as archive:
        text = '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>'
        archive.writestr("SystemStructure.ssd", text)
    with pytest.raises(ScenarioError, match="document type declaration"):
        import_ssp(file, tmp_path / "out")
    secret = '<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>'
    binding = '<a:ParameterBinding source="p.ssv"/>'
    with pytest.raises(ScenarioError, match=r"p\.ssv has a document type declaration"):
        pack.load(system(DAMPER, bindings=binding), p__ssv=secret)


@pytest.mark.parametrize("name", ["../evil.txt", "/evil.txt", "a/../../evil.txt", "c:evil.txt"])
def test_a_member_that_leaves_the_folder_is_refused(name: str, tmp_path: Path) -> None:
    file = tmp_path / "in" / "bench.ssp"
    file.parent.mkdir()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(name, "x")
    with pytest.raises(ScenarioError, match="leaves the archive"):
        import_ssp(file, tmp_path / "out")
    assert [entry.name for entry in tmp_path.rglob("*")] == ["in", "bench.ssp"]


def test_bombs_and_what_is_no_package_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "bench.ssp"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", bytes(80 * 1024**2))
    with pytest.raises(ScenarioError, match="zip bomb"):
        import_ssp(file, tmp_path / "out")
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", bytes(20 * 1024**2))
    with pytest.raises(ScenarioError, match="larger than 16 MiB"):
        import_ssp(file, tmp_path / "out")
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("other.txt", "x")
    with pytest.raises(ScenarioError, match="so it is no SSP"):
        import_ssp(file, tmp_path / "out")
    file.write_bytes(b"no zip")
    with pytest.raises(ScenarioError, match="not an SSP"):
        import_ssp(file, tmp_path / "out")
    with pytest.raises(ScenarioError, match="no such file"):
        import_ssp(tmp_path / "none.ssp", tmp_path / "out")


def test_what_stands_in_the_folder_stays(pack: Packer) -> None:
    package = pack(system(DAMPER))
    import_ssp(package, pack.folder / "out")
    with pytest.raises(ScenarioError, match="is there already"):
        import_ssp(package, pack.folder / "out")


LAST = """
import json, sys
import bristle
frame = bristle.run(sys.argv[1], json.loads(sys.argv[2]))
print(json.dumps({name: float(frame[name].iloc[-1]) for name in frame}), flush=True)
"""


def last_row(name: str, **overrides: float) -> dict[str, float]:
    """Return the last row of a foreign package's run, in a process of its own."""
    import json

    package = FOREIGN / f"{name}.ssp"
    if not package.is_file():
        pytest.skip(f"{package} is not here")
    job = json.dumps({key.replace("__", "."): value for key, value in overrides.items()})
    done = subprocess.run(
        [sys.executable, "-c", LAST, str(package), job],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_foreign_packages_give_their_numbers() -> None:
    found = last_row("LinearTransformation", run__step=0.1)
    assert (found["Gain1.y"], found["Add1.y"]) == (0.0, 3.0)  # Add1.u1 = 3, its u2 = 0
    found = last_row("LinearTransformation3", run__step=0.1)
    assert found["Gain1.y"] == found["Add1.y"] == 14.0 * 13.0  # (4*2 + 5) * (2*2 + 10)
    found = last_row("import_export_parameters1", run__step=0.1)
    assert found["addP.y"] == pytest.approx(30.0 * -20.0)  # the system's k_cref and Input_cref


def test_a_foreign_motor_turns() -> None:
    """12 V, 0.5 Ohm, 0.1 Vs/rad, 0.001 Nms/rad and a load of 0.5 Nm settle where torques agree."""
    found = last_row("dcmotor", run__stop=10.0, run__step=0.0005)
    speed = (0.1 * 12.0 / 0.5 - 0.5) / (0.1**2 / 0.5 + 0.001)
    assert found["SuT_edrive_mass.wB"] == pytest.approx(speed, rel=1e-4)


@pytest.mark.parametrize(
    "name", ["importStartValues", "importStartValues1", "importParameterMapping"]
)
def test_packages_without_fmus_are_read_and_not_run(name: str, tmp_path: Path) -> None:
    package = FOREIGN / f"{name}.ssp"
    if not package.is_file():
        pytest.skip(f"{package} is not here")
    with open_package(package) as opened:
        system = read_structure(opened).system
    assert system.values
    with pytest.raises(ScenarioError, match="nothing to run"):
        import_ssp(package, tmp_path / "out")
