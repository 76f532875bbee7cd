"""Builds: the same bytes for the same source, nothing done twice, FMUs that stand alone."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from built import COMPONENTS, built, lively
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from fresh import fresh
from kinds import ONE_OF_EACH

from bristle.errors import BuildError, PhysicsError, RecordError
from bristle.fmu import catalogue
from bristle.fmu.build import BuildPlan, build, built_guid, ensure, plan

ROOT = Path(__file__).resolve().parents[2]
each_component = pytest.mark.parametrize("component", COMPONENTS)

BUILDING = """
schema = 1
name = "five storeys"
masses = [3.0, 2.0, 2.0, 2.0, 2.0, 1.5]
stiffnesses = [900.0, 4e3, 4e3, 3e3, 3e3, 2e3]
damping_ratio = 0.02
"""
FIXED = """
schema = 1
masses = [2.0, 1.5]
stiffnesses = [4e3, 3e3]
base = "fixed"
damping_ratio = 0.02
"""
RAMP = "time [s],acceleration [m/s2]\n0,1\n1,2\n2,3\n"


@pytest.fixture
def write(tmp_path: Path) -> Any:
    def write(text: str, name: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


# -- the same bytes


def copy_of_the_source(folder: Path) -> Path:
    """Return a copy of what builds FMUs, in a folder of its own."""
    for part in ("bristle", "components"):
        shutil.copytree(
            ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.fmu")
        )
    for file in ("build_fmus.py", "LICENSE"):
        shutil.copyfile(ROOT / file, folder / file)
    return folder


def python(folder: Path, *arguments: str, **environment: str) -> str:
    """Run Python on a copy of the source, away from this one; return what it printed."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**clean, "PYTHONPATH": str(folder), **environment},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    "names",
    # All 21 components built a second time.
    [["Structure", "LuGreDamper", "GroundMotion"], pytest.param([], marks=pytest.mark.slow)],
    ids=["three", "all"],
)
def test_another_folder_and_process_build_the_same_bytes(names: list[str], tmp_path: Path) -> None:
    folder = copy_of_the_source(tmp_path / "a copy, elsewhere")
    printed = python(folder, "build_fmus.py", *names, PYTHONHASHSEED="7", TZ="Asia/Tokyo")
    assert len(printed.splitlines()) == len(names or COMPONENTS)
    for component in names or COMPONENTS:
        assert digest(folder / "fmus" / f"{component}.fmu") == digest(built(component)), component


DIGESTS = (
    "import json; from bristle.fmu import build, catalogue; "
    "print(json.dumps({n: build.plan(n).digest() for n in catalogue.component_names()}))"
)


def test_the_digest_changes_with_every_part_of_the_source(tmp_path: Path) -> None:
    folder = copy_of_the_source(tmp_path)

    def changed(file: str) -> set[str]:
        path = folder / file
        before = path.read_text(encoding="utf-8")
        path.write_text(before + "\n# edited\n", encoding="utf-8")
        after = json.loads(python(folder, "-c", DIGESTS))
        path.write_text(before, encoding="utf-8")
        return {name for name in COMPONENTS if after[name] != first[name]}

    first = json.loads(python(folder, "-c", DIGESTS))
    assert first == {name: plan(name).digest() for name in COMPONENTS}
    assert len(set(first.values())) == len(first)
    for file in ("physics/effects/stribeck.py", "physics/linear.py", "fmu/slave.py", "units.py"):
        assert changed(f"bristle/{file}") == set(COMPONENTS), file
    assert changed("components/structure.py") == {"Structure"}
    assert changed("bristle/data/ground_motions/el_centro_1940_ns.csv") == {"GroundMotion"}
    assert changed("bristle/cli/__init__.py") == set()


def test_a_name_a_building_and_start_values_change_the_digest(write: Any) -> None:
    first, second = write(BUILDING, "a.toml"), write(BUILDING, "b.toml")
    plans = [
        plan("Structure"),
        plan("Structure", name="Other"),
        plan("Structure", building=first),
        plan("Structure", starts={"attached_mass": 0.5}),
        plan("Structure", building=write(FIXED, "c.toml")),
    ]
    assert len({p.digest() for p in plans}) == len(plans)
    assert plan("Structure", building=second) == plans[2]
    assert len({p.guid() for p in plans}) == len(plans)
    assert re.fullmatch(r"[0-9a-f]{12}", plans[0].digest())


# -- nothing done twice


def test_a_name_that_no_component_has_is_refused_with_the_near_one() -> None:
    with pytest.raises(BuildError, match=r'no component "LuGreDampr".*"LuGreDamper"'):
        plan("LuGreDampr")


def spoil(path: Path, how: str) -> None:
    content = bytearray(path.read_bytes())
    if how == "truncated":
        content = content[: len(content) // 2]
    elif how == "empty":
        content = bytearray()
    elif how == "flipped":
        with zipfile.ZipFile(path) as archive:
            begin = archive.getinfo("modelDescription.xml").header_offset + 60
        for i in range(begin, begin + 200):
            content[i] ^= 0xFF
    path.write_bytes(content)


def test_what_is_damaged_is_built_again(tmp_path: Path) -> None:
    path = build(plan("ConstantVoltage"), tmp_path)
    good = path.read_bytes()
    for how in ("truncated", "empty", "flipped", "another", "missing"):
        if how == "missing":
            path.unlink()
        elif how == "another":
            shutil.copyfile(built("SignalSource"), path)
        else:
            spoil(path, how)
        assert build(plan("ConstantVoltage"), tmp_path).read_bytes() == good, how


def test_many_processes_build_into_one_folder(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from bristle.fmu.build import build, plan; "
        "print(build(plan('ConstantVoltage'), Path(sys.argv[1])))"
    )
    crowd = [
        subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path / "fmus")],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(3)
    ]
    for process in crowd:
        out, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
        assert out.strip() == str(tmp_path / "fmus" / "ConstantVoltage.fmu")
    assert digest(tmp_path / "fmus" / "ConstantVoltage.fmu") == digest(built("ConstantVoltage"))
    assert {path.name for path in (tmp_path / "fmus").iterdir()} == {".lock", "ConstantVoltage.fmu"}


# -- what an FMU holds


@each_component
def test_an_fmu_holds_names_of_its_own_and_no_traces_of_its_build(component: str) -> None:
    mark = plan(component).digest()
    package = f"resources/bristle_{mark}/"
    with zipfile.ZipFile(built(component)) as archive:
        names = archive.namelist()
        texts = {n: archive.read(n) for n in names if n.endswith((".py", ".json", ".xml", ".txt"))}
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    assert names == sorted(names)
    assert f"{package}physics/damper.py" in names
    assert sum(name.endswith(f"_{mark}.py") for name in names) == 1
    for name, text in texts.items():
        assert str(ROOT).encode() not in text, name
        assert b"bristle_build_" not in text, name
        if "/pythonfmu/" not in name:
            assert not re.search(rb"^\s*(from|import) bristle[.\s]", text, re.MULTILINE), name
    assert not [name for name in names if "__pycache__" in name or name.endswith(".pyc")]
    assert {"binaries/linux64", "binaries/win64"} <= {os.path.dirname(name) for name in names}  # noqa: PTH120


@fresh
def two_builds(paths: list[str], values: list[dict[str, Any]], port: str) -> list[float]:
    """Return an output of several FMUs that live in one process, stepped in turn."""
    from live import OK, Fmu

    fmus = [Fmu(path, f"number {i}") for i, path in enumerate(paths)]
    for fmu, given in zip(fmus, values, strict=True):
        fmu.begin(given)
    for _ in range(3):
        for fmu in fmus:
            assert fmu.step(0.002) == OK
    found = [fmu.get(port) for fmu in fmus]
    for fmu in fmus:
        assert fmu.reset() == OK
    for fmu, given in zip(fmus, values, strict=True):
        fmu.begin(given)
    for fmu in reversed(fmus):
        for _ in range(3):
            assert fmu.step(0.002) == OK
    assert [fmu.get(port) for fmu in fmus] == found
    return found


def test_an_edited_component_lives_beside_the_other(write: Any, tmp_path: Path) -> None:
    first = plan("ConstantVoltage")
    source = first.component.read_text(encoding="utf-8")
    edited = write(source.replace('"level", 4.0', '"level", 8.0'), "constant_voltage.py")
    assert edited.read_text(encoding="utf-8") != source
    second = build(
        BuildPlan("ConstantVoltage", edited, {"name": "ConstantVoltage"}), tmp_path / "b"
    )
    assert two_builds([str(built("ConstantVoltage")), str(second)], [{}, {}], "voltage") == [4, 8]


def test_an_edited_effect_lives_beside_the_other(write: Any, tmp_path: Path) -> None:
    first = build(plan("LuGreDamper", effects=[write(OWN, "ripple.py")]), tmp_path / "a")
    edited = OWN.replace("return p.height", "return 3.0 * p.height")
    assert edited != OWN
    second = build(plan("LuGreDamper", effects=[write(edited, "ripple.py")]), tmp_path / "b")
    values = {"ripple.on": True, "ripple.height": 2.0}
    assert two_builds([str(first), str(second), str(first)], [values] * 3, "force") == [2, 6, 2]


OWN = '''
"""An effect of the user's own."""

from math import tanh

from ..effect import Effect, Parameter


class Ripple(Effect):
    """Ripple: a force that comes and goes along the stroke."""

    name = "ripple"
    site = "damper"
    needs = ("x",)
    zero_at_rest = False
    source = "made up in 2024"
    expect = "a force that repeats along the displacement"
    parameters = {"height": Parameter(0.5, "N", (0.0, 10.0), "largest force")}

    @staticmethod
    def force(q, z, p):
        return p.height * tanh((q.x + 1.0) / 0.01)
'''


def test_an_effect_of_the_users_own_takes_part(write: Any, tmp_path: Path) -> None:
    path = build(plan("BinghamDamper", effects=[write(OWN, "ripple.py")]), tmp_path)
    assert validate_fmu(str(path)) == []
    assert two_builds([str(path)], [{"ripple.on": True, "ripple.height": 3.0}], "force") == [3.0]


FOLLOWING = OWN.replace(
    '"largest force")}',
    """"largest force"),
        "signal": Parameter(2e5, "Pa", (0.0, 1e7), "pressure"),
    }
    assumed = ("signal",)
    channels = {"signal": "pressure"}""",
).replace("p.height * tanh((q.x + 1.0) / 0.01)", "p.height * 1e-5 * p.signal")


def test_an_effect_that_follows_a_channel_has_it_as_an_input(write: Any, tmp_path: Path) -> None:
    path = build(plan("BinghamDamper", effects=[write(FOLLOWING, "ripple.py")]), tmp_path)
    assert validate_fmu(str(path)) == []
    variables = {one.name: one for one in read_model_description(str(path)).modelVariables}
    assert variables["pressure"].causality == "input"
    assert variables["pressure"].unit == "Pa"
    assert "ripple.signal" not in variables
    on = {"ripple.on": True, "ripple.height": 3.0}
    given = [on, {**on, "pressure": 5e5}, {"pressure": 5e5}]
    assert two_builds([str(path)] * 3, given, "force") == pytest.approx([6.0, 15.0, 0.0])


def test_a_parameter_that_is_declared_as_a_whole_number_is_real(write: Any) -> None:
    file = write(OWN.replace("Parameter(0.5,", "Parameter(1,"), "ripple.py")
    assert "Parameter(1," in file.read_text()
    told = catalogue.describe("BinghamDamper", effects=[file]).variables
    assert told["ripple.height"].kind == "Real"


def test_an_input_is_not_called_as_a_parameter_of_the_law(write: Any) -> None:
    file = write(FOLLOWING.replace('"pressure"}', '"f_c"}'), "ripple.py")
    told = catalogue.describe("BinghamDamper", effects=[file]).variables
    assert told["measured_f_c"].causality == "input"
    assert told["f_c"].causality == "parameter"


@pytest.mark.parametrize(
    ("spoilt", "says"),
    [
        (OWN.replace('"damper"', '"roof"'), "site 'roof' is none of"),
        (OWN.replace("def force", "def pull"), "defines no hook"),
        (OWN.replace('"N"', '"Newtonn"'), "Newtonn"),
        (OWN.replace("class Ripple", "class Ripple)"), "line 9: .*(invalid syntax|unmatched)"),
        (OWN.replace("Effect, Parameter", "Effekt"), r"line 6: \.\.effect is imported"),
        (OWN + "\n1 / 0\n", "line 24: imports, constants, functions and one class"),
    ],
)
def test_an_effect_that_cannot_be_is_said_so(
    write: Any, tmp_path: Path, spoilt: str, says: str
) -> None:
    with pytest.raises(PhysicsError, match=says):
        build(plan("BinghamDamper", effects=[write(spoilt, "ripple.py")]), tmp_path / "fmus")
    assert not list((tmp_path / "fmus").glob("*.fmu"))
    own = [name for name in sys.modules if name.startswith("bristle_")]
    assert all(name.startswith("bristle_own_effects.") for name in own)


# -- another building, a record baked in, start values


def outputs(path: Path) -> list[str]:
    variables = read_model_description(str(path)).modelVariables
    return [v.name for v in variables if v.causality == "output"]


@fresh
def pushed(path: str) -> dict[str, Any]:
    """Return the outputs under a constant damper force, at once and at rest."""
    from live import OK, Fmu

    with Fmu(path) as fmu:
        first = fmu.begin({"damper_force": 6.0}).outputs()
        assert fmu.step(1e4) == OK
        return {"first": first, "rest": fmu.outputs()}


def test_a_building_becomes_a_structure(write: Any, tmp_path: Path) -> None:
    what = plan("Structure", name="FiveStoreys", building=write(BUILDING, "five.toml"))
    path = build(what, tmp_path)
    assert path.name == "FiveStoreys.fmu"
    assert validate_fmu(str(path)) == []
    names = outputs(path)
    assert [n for n in names if n.startswith("drift")] == [f"drift{i}" for i in range(1, 6)]
    levels = ["base", *(f"floor{i}" for i in range(1, 6))]
    assert [n for n in names if n.endswith("_velocity")] == [
        f"{level}_velocity" for level in levels
    ]
    found = pushed(path)
    assert found["first"]["base_acceleration_absolute"] == pytest.approx(-6.0 / 3.0)
    assert found["rest"]["base_displacement"] == pytest.approx(-6.0 / 900.0, rel=1e-6)
    assert found["rest"]["drift5"] == pytest.approx(0.0, abs=1e-9)


def test_a_fixed_building_has_no_base(write: Any, tmp_path: Path) -> None:
    path = build(plan("Structure", building=write(FIXED, "fixed.toml")), tmp_path)
    names = outputs(path)
    assert not [name for name in names if name.startswith("base")]
    assert [name for name in names if name.startswith("drift")] == ["drift1", "drift2"]
    found = pushed(path)
    assert found["rest"]["drift1"] == pytest.approx(-6.0 / 4e3, rel=1e-6)
    assert found["rest"]["floor2_displacement"] == pytest.approx(-6.0 / 4e3, rel=1e-6)


def test_twenty_floors_build_and_step(write: Any, tmp_path: Path) -> None:
    text = f"schema = 1\nmasses = {[1e3] * 21}\nstiffnesses = {[1e6] * 21}\ndamping_ratio = 0.05\n"
    path = build(plan("Structure", building=write(text, "tower.toml")), tmp_path)
    assert len(outputs(path)) == 3 * 21 + 20 + 2
    assert pushed(path)["rest"]["floor20_displacement"] == pytest.approx(-6e-6, rel=1e-3)


def test_ensure_keeps_one_file_per_building(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BRISTLE_CACHE", str(tmp_path / "cache"))
    first = ensure("Structure", building=write(BUILDING, "a.toml"))
    assert first.parent == tmp_path / "cache" / "fmus"
    assert ensure("Structure", building=write(BUILDING + "# the same\n", "b.toml")) == first
    other = ensure("Structure", building=write(FIXED, "c.toml"))
    plain = ensure("Structure")
    assert len({first, other, plain}) == 3
    assert built_guid(plain) == plan("Structure").guid()


@fresh
def shaken(path: str, values: dict[str, Any]) -> list[float]:
    from live import OK, Fmu

    with Fmu(path) as fmu:
        found = [fmu.begin(values).get("ground_acceleration")]
        for _ in range(4):
            assert fmu.step(0.5) == OK
            found.append(fmu.get("ground_acceleration"))
        return [*found, fmu.get("record")]


def test_a_built_in_record_is_baked_in_by_its_name(tmp_path: Path) -> None:
    path = build(plan("GroundMotion", record=Path("el_centro_1940_ns")), tmp_path)
    assert shaken(path, {}) == shaken(built("GroundMotion"), {})


@fresh
def started(path: str, values: dict[str, Any]) -> dict[str, Any]:
    from live import Fmu

    with Fmu(path) as fmu:
        kept = {name: fmu.get(name) for name in ("f_c", "gas_spring.on", "v_max")}
        return {**kept, **fmu.begin(values).outputs()}


def test_start_values_are_baked_in_and_can_still_be_set(tmp_path: Path) -> None:
    starts = {"f_c": 2, "gas_spring.on": True, "gas_spring.preload": 0.25, "v_max": 6.0}
    path = build(plan("BinghamDamper", name="Mine", starts=starts), tmp_path)
    variables = {v.name: v for v in read_model_description(str(path)).modelVariables}
    assert float(variables["f_c"].start) == 2.0
    assert variables["gas_spring.on"].start == "true"
    assert validate_fmu(str(path)) == []
    found = started(path, {"velocity": 0.5})
    assert (found["f_c"], found["gas_spring.on"], found["v_max"]) == (2.0, True, 6.0)
    assert found["force"] == pytest.approx(2.25, rel=1e-6)
    assert started(path, {"velocity": 0.5, "f_c": 3.0})["force"] == pytest.approx(3.25, rel=1e-6)


def test_an_input_that_the_build_sets_is_measured_as_one_that_a_host_sets() -> None:
    starts = {"fluid_inertia.on": True, "fluid_inertia.m_f": 2.0}
    kind = catalogue.component_class(catalogue.source("LuGreDamper"))

    def force(baked: dict[str, Any], given: dict[str, float]) -> float:
        slave = kind(baked={"name": "One", "starts": {**starts, **baked}}, instance_name="one")
        slave.setup_experiment(0.0)
        slave.enter_initialization_mode()
        for name, value in given.items():
            slave.set_real([slave._index[name]], [value])
        slave.exit_initialization_mode()
        slave.set_real([slave._index["velocity"]], [0.05])
        assert slave.do_step(0.0, 0.001)
        assert slave.do_step(0.001, 0.001)
        return float(slave["force"])

    assert force({"acceleration": 3.0}, {}) == force({}, {"acceleration": 3.0})
    assert force({"acceleration": 3.0}, {}) == pytest.approx(force({}, {}) + 2.0 * 3.0)


def test_an_acceleration_that_a_host_keeps_at_0_is_one_that_was_not_measured() -> None:
    starts = {"fluid_inertia.on": True, "fluid_inertia.m_f": 2.0}
    kind = catalogue.component_class(catalogue.source("LuGreDamper"))

    def forces(accelerations: list[float | None]) -> list[float]:
        slave = kind(baked={"name": "One", "starts": starts}, instance_name="one")
        slave.setup_experiment(0.0)
        slave.enter_initialization_mode()
        slave.exit_initialization_mode()
        found = []
        for k, a in enumerate(accelerations):
            slave.set_real([slave._index["velocity"]], [5e-5 * k * k])
            if a is not None:
                slave.set_real([slave._index["acceleration"]], [a])
            assert slave.do_step(1e-3 * k, 1e-3)
            found.append(float(slave["force"]))
        return found

    unconnected = forces([None] * 5)
    assert forces([0.0] * 5) == unconnected
    assert forces([0.0] * 4 + [0.9])[:4] == unconnected[:4]  # from the first value on it is taken
    assert forces([0.0] * 4 + [0.9])[4] != unconnected[4]


# -- what is refused


@pytest.mark.parametrize("name", ["", "2nd", "a b", "a-b", "a.b", "a/b", "../x", "Gebäude", "a\n"])
def test_names_that_no_model_can_have(name: str) -> None:
    with pytest.raises(BuildError, match="is no model name: letters, digits and _ are right"):
        plan("Structure", name=name)


@pytest.mark.parametrize(
    ("component", "starts", "says"),
    [
        ("BinghamDamper", {"f_d": 1.0}, 'BinghamDamper has no parameter "f_d"'),
        ("BinghamDamper", {"force": 1.0}, 'BinghamDamper has no parameter "force"'),
        ("BinghamDamper", {"f_c": "two"}, "f_c"),
        ("BinghamDamper", {"f_c": -1.0}, "f_c"),
        ("BinghamDamper", {"f_c": float("nan")}, "f_c"),
        ("BinghamDamper", {"gas_spring.on": 1.0}, "gas_spring.on"),
        ("GroundMotion", {"record": 3.0}, "record"),
    ],
)
def test_start_values_that_cannot_be(component: str, starts: dict[str, Any], says: str) -> None:
    with pytest.raises(BuildError, match=says):
        plan(component, starts=starts)


def test_what_does_not_belong_together(write: Any) -> None:
    with pytest.raises(BuildError, match="a building goes into Structure, not into LuGreDamper"):
        plan("LuGreDamper", building=write(BUILDING, "a.toml"))
    with pytest.raises(BuildError, match="a record goes into GroundMotion, not into Structure"):
        plan("Structure", record=write(RAMP, "a.csv"))
    with pytest.raises(BuildError, match=r'no component "Structur".*Did you mean "Structure"'):
        plan("Structur")


def test_wrong_files_are_named(write: Any, tmp_path: Path) -> None:
    with pytest.raises(PhysicsError, match=r"a\.toml:\d+: .*masses\[0\] = -3.0 must be positive"):
        plan("Structure", building=write(BUILDING.replace("[3.0", "[-3.0"), "a.toml"))
    with pytest.raises(PhysicsError, match=r"none\.toml: there is no such file"):
        plan("Structure", building=tmp_path / "none.toml")
    with pytest.raises(RecordError, match=r"none\.csv"):
        plan("GroundMotion", record=tmp_path / "none.csv")
    with pytest.raises((RecordError, PhysicsError), match=r"a\.csv"):
        plan("GroundMotion", record=write(RAMP.replace("2\n", "two\n"), "a.csv"))
    with pytest.raises(PhysicsError, match=r"none\.py"):
        build(plan("BinghamDamper", effects=[tmp_path / "none.py"]), tmp_path)


def test_a_folder_that_is_a_file(write: Any) -> None:
    path = write("", "taken")
    for folder in (path, path / "fmus"):
        with pytest.raises(BuildError, match=r"Structure\.fmu: cannot be written"):
            build(plan("Structure"), folder)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_a_folder_that_must_not_be_written(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    try:
        with pytest.raises(BuildError, match=r"Structure\.fmu: cannot be written .*ermission"):
            build(plan("Structure"), tmp_path)
    finally:
        tmp_path.chmod(0o755)


def test_a_full_disk_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build(plan("ConstantVoltage"), tmp_path)
    (old := tmp_path / "ConstantVoltage.fmu").rename(target := tmp_path / "Structure.fmu")
    assert not old.exists()
    before = target.read_bytes()

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "writestr", full)
    with pytest.raises(BuildError, match=r"Structure\.fmu: cannot be written \(No space left"):
        build(plan("Structure"), tmp_path)
    assert target.read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} == {".lock", "Structure.fmu"}


# -- Pythons other than this one

STANDALONE = """
import json, sys
from pathlib import Path

job = json.loads(sys.argv[1])
sys.path.insert(0, job["resources"])
module = __import__(job["module"])
kind = getattr(module, job["component"])
slave = kind(instance_name="alone", resources=job["resources"])
names = {v.name: i for i, v in slave.vars.items()}
for name, value in job["values"].items():
    setter = {bool: slave.set_boolean, str: slave.set_string, float: slave.set_real}[type(value)]
    setter([names[name]], [value])
slave.setup_experiment(0.0, None, None)
slave.enter_initialization_mode()
slave.exit_initialization_mode()
inputs = [names[name] for name in job["inputs"]]
outputs = [i for i, v in slave.vars.items() if v.causality.name == "output"]
rows = []
for k in range(100):
    values = [job["scale"][i] * ((k * (3 + i)) % 7 - 2.5) for i in range(len(inputs))]
    slave.set_real(inputs, values)
    assert slave.do_step(0.002 * k, 0.002), [m.msg for m in slave.log_queue]
    rows.append([value.hex() for value in slave.get_real(outputs)])
    if k == 50:
        state = slave._fmu_state_from_bytes(slave._fmu_state_to_bytes(slave._get_fmu_state()))
        slave._set_fmu_state(state)
own = [m for m in sys.modules if m.split(".")[0] in ("bristle", "numpy", "scipy", "numba")]
print(json.dumps({"rows": rows, "fault": slave.fault, "own": own, "xml": len(slave.to_xml())}))
"""


def other_python(version: str) -> str | None:
    """Return a Python of this version, from the path or from pyenv's folder."""
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    found = sorted(root.glob(f"versions/{version}.*/bin/python3"))
    candidates = [str(found[-1])] if found else []
    for python in [*candidates, shutil.which(f"python{version}")]:
        if python:
            asked = [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
            done = subprocess.run(asked, capture_output=True, text=True)
            if done.returncode == 0 and done.stdout.strip() == version:
                return python
    return None


@cache
def alone(component: str, python: str) -> dict[str, Any]:
    """Run the script of an FMU in a Python, without binary, numpy or anything installed."""
    import tempfile

    variables = read_model_description(str(built(component))).modelVariables
    inputs = [v.name for v in variables if v.causality == "input"]
    scale = {"displacement": 0.01, "velocity": 0.2, "voltage": 4.0}
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(built(component)) as archive:
            archive.extractall(folder)
        resources = Path(folder, "resources")
        job = {
            "resources": str(resources),
            "module": (resources / "slavemodule.txt").read_text(encoding="utf-8").strip(),
            "component": component,
            "values": lively(component),
            "inputs": inputs,
            "scale": [scale.get(name, 2.0) for name in inputs],
        }
        command = [python, "-I", "-S", "-W", "error", "-c", STANDALONE, json.dumps(job)]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=120)
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


@pytest.mark.parametrize("version", ["3.9", "3.13"])
@pytest.mark.parametrize(
    "component",
    [
        # Half a second each: one component of each other kind.
        one if one in ("Structure", "LuGreDamper") else pytest.param(one, marks=pytest.mark.slow)
        for one in ONE_OF_EACH
    ],
)
def test_an_fmu_runs_on_other_pythons(component: str, version: str) -> None:
    python = other_python(version)
    if python is None:
        pytest.skip(f"there is no Python {version} on this machine")
    here = alone(component, sys.executable)
    there = alone(component, python)
    assert there["fault"] == 0
    assert there["own"] == []
    assert there == here
