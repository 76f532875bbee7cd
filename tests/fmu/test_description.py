"""Reading and unpacking FMUs: what they say of themselves, and files that must not be opened."""

from __future__ import annotations

import os
import stat
import struct
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from bristle.component import OVER_STEP
from bristle.errors import FmuError
from bristle.fmu import archive, build, catalogue
from bristle.fmu.archive import extract, library_member
from bristle.fmu.description import read_description

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Plant" guid="{1}" description="a plant">
  <CoSimulation modelIdentifier="Plant" canGetAndSetFMUstate="true"/>
  <UnitDefinitions>
    <Unit name="m"><BaseUnit m="1"/></Unit><Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Force"><Real unit="N" min="-10" max="10" nominal="5"/></SimpleType>
    <SimpleType name="Kind"><Enumeration><Item name="a" value="1"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <VendorAnnotations>
    <Tool name="other"><optional>x</optional></Tool>
    <Tool name="bristle"><optional>x flag</optional></Tool>
  </VendorAnnotations>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="input" description="where it is">
      <Real unit="m" start="0.5" min="-1" max="1" nominal="0.1"/>
      <Annotations><Tool name="other"><overStep>late</overStep></Tool>
      <Tool name="bristle"><overStep>linear</overStep></Tool></Annotations></ScalarVariable>
    <ScalarVariable name="flag" valueReference="0" causality="input" variability="discrete">
      <Boolean start="true"/></ScalarVariable>
    <ScalarVariable name="force" valueReference="1" causality="output">
      <Real declaredType="Force" max="8"/>
      <Annotations><Tool name="bristle"><jumpsWithout>x</jumpsWithout></Tool></Annotations>
    </ScalarVariable>
    <ScalarVariable name="count" valueReference="0" causality="output" variability="discrete">
      <Integer/></ScalarVariable>
    <ScalarVariable name="quiet" valueReference="9" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="kind" valueReference="1" causality="parameter" variability="fixed">
      <Enumeration declaredType="Kind" start="1"/></ScalarVariable>
    <ScalarVariable name="text" valueReference="0" causality="parameter" variability="fixed">
      <String start="a b"/></ScalarVariable>
    <ScalarVariable name="state" valueReference="12"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs>
    <Unknown index="3" dependencies="1 8" dependenciesKind="dependent dependent"/>
    <Unknown index="4" dependencies=""/><Unknown index="5"/>
  </Outputs></ModelStructure>
</fmiModelDescription>
"""

Write = Callable[..., Path]


def library() -> bytes:
    """Return the beginning of a shared library of this platform."""
    if sys.platform == "win32":
        return b"MZ" + bytes(62)
    if sys.platform == "darwin":
        return b"\xcf\xfa\xed\xfe" + bytes(60)
    return Path(sys.executable).resolve().read_bytes()[:64]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes an FMU, sound unless told otherwise."""

    def make(
        *changes: tuple[str, str],
        binary: str | None = library_member("Plant"),
        code: bytes | None = None,
        add: dict[str, bytes] | None = None,
    ) -> Path:
        text = XML
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "Plant.fmu"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("modelDescription.xml", text)
            if binary:
                file.writestr(binary, library() if code is None else code)
            for name, data in (add or {}).items():
                file.writestr(name, data)
        return path

    return make


def test_everything_that_an_fmu_says_is_read(write: Write) -> None:
    plant = read_description(write())
    assert (plant.name, plant.guid, plant.identifier) == ("Plant", "{1}", "Plant")
    assert plant.description == "a plant"
    assert plant.capabilities == {"canGetAndSetFMUstate": "true"}
    names = ["x", "flag", "force", "count", "quiet", "kind", "text", "state"]
    assert list(plant.variables) == names
    assert [v.name for v in plant.of("output")] == ["force", "count", "quiet"]
    x = plant.variables["x"]
    assert (x.kind, x.reference, x.unit, x.start) == ("Real", 0, "m", 0.5)
    assert (x.minimum, x.maximum, x.nominal) == (-1.0, 1.0, 0.1)
    assert (x.description, x.variability, x.causality) == ("where it is", "continuous", "input")
    starts = [plant.variables[name].start for name in ("flag", "kind", "text", "state")]
    assert starts == [True, 1, "a b", None]
    assert plant.variables["state"].causality == "local"


def test_declared_type_gives_what_the_variable_leaves_out(write: Write) -> None:
    force = read_description(write()).variables["force"]
    assert (force.unit, force.minimum, force.maximum, force.nominal) == ("N", -10.0, 8.0, 5.0)


def test_dependencies_name_inputs_only_and_silence_is_none(write: Write) -> None:
    variables = read_description(write()).variables
    found = [variables[name].dependencies for name in ("force", "count", "quiet", "x")]
    assert found == [("x",), (), None, None]


def test_how_an_input_is_taken_comes_from_our_annotation_only(write: Write) -> None:
    variables = read_description(write()).variables
    assert {name: v.over_step for name, v in variables.items() if v.over_step} == {"x": "linear"}


def test_an_output_that_jumps_names_the_input_that_cures_it(write: Write) -> None:
    variables = read_description(write()).variables
    assert {n: v.jumps_without for n, v in variables.items() if v.jumps_without} == {"force": "x"}
    with pytest.raises(FmuError, match='"force" may jump without "count", but no input has'):
        read_description(write((">x</jumps", ">count</jumps")))


def test_optional_inputs_come_from_our_annotation_only(write: Write) -> None:
    variables = read_description(write()).variables
    assert [name for name, v in variables.items() if v.optional] == ["x", "flag"]
    strange = write(('name="bristle"', 'name="somebody"'))
    assert not any(v.optional for v in read_description(strange).variables.values())
    with pytest.raises(FmuError, match='calls "force" optional, but no input has that name'):
        read_description(write(("<optional>x flag<", "<optional>force<")))


CHANGES = [
    ('fmiVersion="2.0"', 'fmiVersion="1.0"', "FMI version 1.0; FMI 2.0 or 3.0"),
    ('fmiVersion="2.0"', "", "FMI version not given"),
    ("CoSimulation", "ModelExchange", "model exchange only"),
    ('<CoSimulation modelIdentifier="Plant"', "<Other", "not for co-simulation;"),
    ('modelIdentifier="Plant"', 'modelIdentifier="../x"', "'../x' is no name"),
    ("fmiModelDescription", "html", "is <html>, not FMI's"),
    ("</ModelVariables>", "", "not well-formed XML"),
    ('encoding="UTF-8"', 'encoding="no-such"', "not well-formed XML"),
    ('valueReference="9"', 'valueReference="-9"', "reference '-9' is no unsigned"),
    ('valueReference="9"', f'valueReference="{2**32}"', "is no unsigned integer"),
    ('valueReference="9"', f'valueReference="{"9" * 5000}"', "is no unsigned integer"),
    ('name="quiet"', 'name="force"', "variables defined twice: force"),
    ('name="quiet"', "", "a variable has no name"),
    ('start="0.5"', 'start="half"', "the start 'half' is no Real"),
    ('start="true"', 'start="yes"', "the start 'yes' is no Boolean"),
    ('start="1"/>', 'start="1.5"/>', "the start '1.5' is no Enumeration"),
    ('max="8"', 'max="nan"', "max is not a number"),
    ('max="8"', 'max="high"', "max is 'high', not a number"),
    ("<String start", "<Text start", '"text" has no type'),
    (">linear<", ">late<", "overStep is 'late', none of held, linear, sampled"),
    ('index="3"', 'index="9"', "names variable '9'; the variables are 1 to 8"),
    ('index="3"', 'index="0"', "names variable '0'"),
    ('dependencies="1 8"', 'dependencies="1 x"', "names variable 'x'"),
]


@pytest.mark.parametrize(("old", "new", "words"), CHANGES, ids=[c[2] for c in CHANGES])
def test_wrong_description_is_refused(write: Write, old: str, new: str, words: str) -> None:
    path = write((old, new))
    with pytest.raises(FmuError) as refused:
        read_description(path)
    assert words in str(refused.value)
    assert str(refused.value).startswith(str(path))


@pytest.mark.parametrize(
    "entities",
    [
        '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>',
        '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE fmiModelDescription SYSTEM "http://localhost/x.dtd">',
    ],
)
def test_document_type_is_refused(write: Write, entities: str) -> None:
    path = write(("<fmiModelDescription", f"{entities}<fmiModelDescription"))
    with pytest.raises(FmuError, match="document type declaration"):
        read_description(path)


def test_deep_nesting_neither_crashes_nor_hangs(write: Write) -> None:
    deep = "<a>" * 200_000 + "</a>" * 200_000
    path = write(("<VendorAnnotations>", f"<VendorAnnotations>{deep}"))
    assert read_description(path).name == "Plant"


def test_missing_binary_names_those_that_are_there(write: Write) -> None:
    others = {"binaries/win32/Plant.dll": b"MZ", "sources/plant.c": b"int x;"}
    path = write(binary=None, add=others)
    with pytest.raises(FmuError, match="There are: win32, C sources"):
        read_description(path)
    assert read_description(path, any_platform=True).name == "Plant"
    with pytest.raises(FmuError, match="There are: none"):
        read_description(write(binary=None))


@pytest.mark.skipif(sys.platform != "linux", reason="the kinds below are foreign to Linux only")
@pytest.mark.parametrize(
    ("code", "found"),
    [
        (b"MZ" + bytes(60), "is a Windows library"),
        (b"\xcf\xfa\xed\xfe" + bytes(60), "is a macOS library"),
        (
            b"\x7fELF\x01\x01" + bytes(12) + struct.pack("<H", 3),
            "is a 32-bit Linux library for x86",
        ),
        (b"text", "is no shared library"),
        (b"", "is no shared library"),
    ],
)
def test_binary_of_another_platform_is_refused(write: Write, code: bytes, found: str) -> None:
    with pytest.raises(FmuError, match=found):
        read_description(write(code=code))


@pytest.mark.parametrize(
    "name", ["../x", "a/../../x", "/etc/x", "C:/x", "C:\\x", "..\\x", "a\\..\\..\\x", "\\\\host\\x"]
)
@pytest.mark.parametrize("act", ["read", "extract"])
def test_member_that_leaves_the_archive_is_refused(
    write: Write, tmp_path: Path, name: str, act: str
) -> None:
    path = write(add={"resources/good.txt": b"good", name: b"bad"})
    folder = tmp_path / "deep" / "out"
    with pytest.raises(FmuError, match="leaves the archive's folder: refused"):
        read_description(path) if act == "read" else extract(path, folder)
    assert not folder.exists()  # nothing was unpacked, not even what is sound


def _with_member(path: Path, info: zipfile.ZipInfo, data: bytes) -> Path:
    with zipfile.ZipFile(path, "a") as file:
        file.writestr(info, data)
    return path


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFCHR, stat.S_IFIFO])
def test_links_and_devices_are_refused(write: Write, tmp_path: Path, kind: int) -> None:
    info = zipfile.ZipInfo("resources/link")
    info.external_attr = (kind | 0o777) << 16
    path = _with_member(write(), info, b"/etc/passwd")
    with pytest.raises(FmuError, match="is a link or device: refused"):
        extract(path, tmp_path / "out")


def test_encrypted_member_is_refused(write: Write) -> None:
    path = write(add={"resources/x": b"secret"})
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\x01\x02")  # the last entry of the directory is that of resources/x
    data[at + 8] |= 1
    path.write_bytes(data)
    with pytest.raises(FmuError, match="is encrypted: refused"):
        read_description(path)


def test_a_member_that_is_there_twice_is_refused_where_the_two_differ(write: Write) -> None:
    path = write(add={"resources/x": b"one"})
    for content, refused in ((b"one", False), (b"other", True)):
        with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate"):
            archive.writestr("resources/x", content)
        if refused:
            with pytest.raises(FmuError, match=r"two members 'resources/x' that differ"):
                read_description(path)
        else:
            read_description(path)


def test_zip_bomb_is_refused_by_its_directory(write: Write, tmp_path: Path) -> None:
    path = write(add={"resources/zeros": bytes(80 * 1024**2)})
    assert path.stat().st_size < 1024**2
    with pytest.raises(FmuError, match="refused as a zip bomb"):
        extract(path, tmp_path / "out")


def test_sizes_and_counts_are_bounded(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(add={f"resources/{k}": os.urandom(1000) for k in range(20)})
    with monkeypatch.context() as patch:
        patch.setattr(archive, "MAX_TOTAL", 10_000)
        with pytest.raises(FmuError, match="unpacks to"):
            extract(path, tmp_path / "out")
    with monkeypatch.context() as patch:
        patch.setattr(archive, "MAX_MEMBERS", 10)
        with pytest.raises(FmuError, match="22 members"):
            extract(path, tmp_path / "out")
    with monkeypatch.context() as patch:
        patch.setattr("bristle.fmu.description.MAX_DESCRIPTION", 1000)
        with pytest.raises(FmuError, match=r"modelDescription\.xml is larger than 0 MiB"):
            read_description(path)


def test_member_that_lies_about_its_size_is_refused(write: Write, tmp_path: Path) -> None:
    path = write(add={"resources/x": b"y" * 100_000})
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\x01\x02")
    data[at + 24 : at + 28] = struct.pack("<I", 10)
    path.write_bytes(data)
    with pytest.raises(FmuError, match="damaged"):
        extract(path, tmp_path / "out")


@pytest.mark.parametrize("what", ["missing", "folder", "text", "empty", "cut", "garbage", "no xml"])
def test_what_is_no_fmu_is_refused(write: Write, tmp_path: Path, what: str) -> None:
    path = tmp_path / "x.fmu"
    words = "not a zip file, so not an FMU"
    if what == "missing":
        words = "there is no such file"
    elif what == "folder":
        path.mkdir()
        words = "this is a folder"
    elif what in ("text", "empty"):
        path.write_text("" if what == "empty" else "hello")
    elif what == "cut":
        path.write_bytes(write().read_bytes()[:-40])
    elif what == "garbage":
        data = bytearray(write().read_bytes())
        data[60:160] = bytes(100)
        path.write_bytes(data)
        words = "damaged"
    else:
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("sub/modelDescription.xml", XML)
        words = "there is no modelDescription.xml at its root"
    with pytest.raises(FmuError, match=words):
        read_description(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this platform")
def test_pipe_is_refused_instead_of_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.fmu")
    with pytest.raises(FmuError, match="device or pipe"):
        read_description(tmp_path / "x.fmu")


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read and write everything"
)
def test_no_permission_is_explained(write: Write, tmp_path: Path) -> None:
    path = write()
    path.chmod(0)
    with pytest.raises(FmuError, match="cannot be read: Permission denied"):
        read_description(path)


def test_folder_that_cannot_be_written_is_explained(write: Write, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(FmuError, match="cannot be unpacked into"):
        extract(write(), tmp_path / "file" / "out")


def test_extract_unpacks_everything(write: Write, tmp_path: Path) -> None:
    path = write(add={"resources/a/b.txt": b"text", "resources\\c.txt": b"windows", "empty/": b""})
    folder = extract(path, tmp_path / "out")
    assert (folder / "resources/a/b.txt").read_bytes() == b"text"
    assert (folder / "resources/c.txt").read_bytes() == b"windows"
    assert (folder / "empty").is_dir()
    assert (folder / library_member("Plant")).read_bytes() == library()


@pytest.mark.parametrize("name", catalogue.component_names())
def test_built_fmu_says_what_the_catalogue_says(name: str) -> None:
    built = read_description(build.ensure(name))
    told = catalogue.describe(name)
    assert list(built.variables) == list(told.variables)
    for variable in built.variables.values():
        other = told.variables[variable.name]
        assert variable.unit == other.unit
        assert variable.dependencies == other.dependencies
        assert variable.optional == other.optional
        assert variable.over_step == other.over_step
        assert variable.jumps_without == other.jumps_without
        assert variable.variability == other.variability


@pytest.mark.parametrize("name", catalogue.component_names())
def test_every_input_says_how_it_is_taken_over_a_step(name: str) -> None:
    found = {v.name: v.over_step for v in catalogue.describe(name).of("input")}
    assert set(found.values()) <= set(OVER_STEP)
    if "sample_period" in catalogue.describe(name).variables:
        assert set(found.values()) == {"sampled"}
    elif found:
        assert found.pop("ground_acceleration", "linear") == "linear"
        assert set(found.values()) == {"held"}


@pytest.mark.parametrize("name", catalogue.component_names())
def test_outputs_that_stand_between_samples_are_discrete(name: str) -> None:
    described = catalogue.describe(name)
    found = {v.variability for v in described.of("output") if v.kind == "Real"}
    stands = "sample_period" in described.variables or name == "ConstantVoltage"
    assert found == {"discrete" if stands else "continuous"}


def test_dry_friction_jumps_unless_it_knows_what_holds_the_mass() -> None:
    found = {
        name: catalogue.describe(name).variables["force"].jumps_without
        for name in catalogue.component_names()
        if name.endswith("Damper")
    }
    assert found.pop("BinghamDamper") == "holding_force"
    assert set(found.values()) == {None}


def test_a_component_cannot_leave_it_open() -> None:
    slave = catalogue.instantiate("ConstantVoltage")
    with pytest.raises(TypeError, match="over_step"):
        slave.add_input("more", "V", "one more")  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="'late' is none of held, linear, sampled"):
        slave.add_input("more", "V", "one more", over_step="late")
