"""The design file: TOML in, a checked task out.

schema = 1
kind = "lpv"                     # or "hinf", "lqg"; the rest may be left out
building = "my_building.toml"    # else the paper's model
device = "brace"                 # what is commanded; else the damper on the first level
sample_period = 0.002            # s
tau = 2.0                        # hinf, lpv: 1 or more; larger: a slower controller
order = 12                       # hinf, lpv: balanced states to keep; else all

[weights]                        # hinf, lpv
acceleration = { gain = 1.5, corner = 12.0 }           # gain w/(s + w), rad/s
command = { gain = 2.0, zero = 15.0, pole = 50.0 }     # gain (s + zero)/(s + pole)
noise = 0.04                     # m/s2; a weight may also be { numerator, denominator }

[damper]
model = "model.toml"             # or law, parameters = { f_c = 1.3 }, effects = ["stribeck"]
v_max = 8.0                      # V
known_to = 0.4                   # m/s, the largest speed of the data behind the model

[scheduling]                     # lpv
grid = [0.0, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3]        # m/s
varies = "none"                  # or "X", "Y": which Lyapunov matrix follows the speed
rate = 1.0                       # m/s2

[passive]                        # dampers at other places, which are not commanded
damper = { damping = 80.0, stiffness = 650.0 }         # N.s/m, N/m; "damper": on the first level

[lqg]                            # lqg: acceleration, drift, force, ground, noise
force = 0.2
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..core.config import Document, Key, Spec
from ..core.text import written
from ..core.toml_lines import KeyPath
from ..data.building_file import read_building
from ..errors import BristleError, DesignError, PhysicsError, StudyError
from ..model.model_file import read_model
from ..physics.building import Building, paper_building
from ..physics.laws import DEFAULT_OF_DESIGN
from .damper import DesignDamper
from .plant import Share
from .task import Scheduling, Task
from .weights import LqgWeights, Weight, Weights

_TABLES = {"hinf": ("weights",), "lpv": ("weights", "scheduling"), "lqg": ("lqg",)}
_WEIGHT_FORMS: dict[frozenset[str], Callable[..., Weight]] = {
    frozenset({"gain", "corner"}): Weight.low_pass,
    frozenset({"gain", "zero", "pole"}): Weight.lead,
    frozenset({"numerator", "denominator"}): Weight,
}


def _weight(value: object) -> Weight:
    form = _WEIGHT_FORMS.get(frozenset(value)) if isinstance(value, Mapping) else None
    if form is None or not isinstance(value, Mapping):
        forms = "; ".join("{ " + ", ".join(sorted(keys)) + " }" for keys in _WEIGHT_FORMS)
        raise DesignError(f"is {written(value)}: expected a weight, one of {forms}.")
    kinds: dict[str, Any] = {"numerator": [float], "denominator": [float]}
    values = {}
    for name, one in value.items():
        try:
            values[name] = Key(kinds.get(name, float)).taken(one)
        except BristleError as error:
            raise DesignError(f"is wrong: {name} {error}") from None
    try:
        return form(**values)
    except DesignError as error:
        raise DesignError(f"is wrong: {error}") from None


_NUMBER = Key(float, None)
_SPECS: dict[str, Spec] = {
    "weights": Spec({
        "acceleration": Key(_weight, None), "command": Key(_weight, None), "noise": _NUMBER,
    }),
    "scheduling": Spec({
        "grid": Key([float], None, "m/s"), "varies": Key(str, None), "rows": Key(int, None),
        **dict.fromkeys(("rate", "eps", "balance_at"), _NUMBER),
    }),
    "lqg": Spec(dict.fromkeys(LqgWeights.__dataclass_fields__, _NUMBER)),
}  # fmt: skip
_SPEC: dict[str, Key | Spec] = {
    "kind": Key(str, choices=_TABLES), "title": Key(str, ""), "building": Key(str, ""),
    "device": Key(str, ""), "sample_period": Key(float, None, "s"), "tau": _NUMBER,
    "order": Key(int, None),
    "damper": Spec({
        "law": Key(str, DEFAULT_OF_DESIGN), "parameters": Spec(each=Key(float, 0.0)),
        "effects": Key([str], ()), "model": Key(str, ""), "v_max": Key(float, None, "V"),
        "known_to": Key(float, None, "m/s"),
    }),
    "passive": Spec(each=Spec({
        "damping": Key(float, 0.0, "N.s/m"), "stiffness": Key(float, 0.0, "N/m"),
    })),
}  # fmt: skip


def read_task(path: str | Path) -> Task:
    """Return the task of a design file.

    Raises
    ------
    DesignError
        With every mistake of the file and its line.
    PhysicsError
        If the building's file is wrong.
    """
    return task_of(Document(path, DesignError), Path(path).parent)


def task_from_data(data: Mapping[str, Any], folder: Path, where: str = "design") -> Task:
    """Return the task that the content of a design file describes.

    Parameters
    ----------
    data, folder, where
        The content, the folder of its paths, what messages call it.

    Raises
    ------
    DesignError, PhysicsError
        As `read_task`.
    """
    return task_of(Document(where, DesignError, data), folder)


def task_of(document: Document, folder: Path, place: tuple[Building, str] | None = None) -> Task:
    """Return the task of a design file that is open; paths are from `folder`.

    Parameters
    ----------
    document, folder
        The file, the folder of its paths.
    place : building and device where the file names none; else the paper's building

    Raises
    ------
    DesignError, PhysicsError
        As `read_task`.
    """
    kind = document.data.get("kind")
    tables = _TABLES[kind] if isinstance(kind, str) and kind in _TABLES else tuple(_SPECS)
    found = document.read(Spec(_SPEC | {name: _SPECS[name] for name in tables}))
    for key in ("tau", "order"):
        if kind == "lqg" and found[key] is not None:
            document.error((key,), f"{key} is of hinf and lpv designs; lqg has none.")
    document.check()
    building, usual = place or (paper_building(), "")
    if found["building"]:
        building, usual = read_building(folder / found["building"]), ""
    keys = ("sample_period", "tau", "order")
    given = {key: found[key] for key in keys if found[key] is not None}
    given |= {"kind": kind, "title": found["title"], "building": building}
    given |= {"device": found["device"] or usual}
    given["passive"] = {name: Share(**share) for name, share in found["passive"].items()}
    kinds = {"weights": Weights, "scheduling": Scheduling, "lqg": LqgWeights}
    for name in tables:
        values = {key: value for key, value in found[name].items() if value is not None}
        given[name] = _made(document, (name,), kinds[name], **values)
    given["damper"] = _damper(document, found["damper"], folder)
    document.check()
    task: Task = _made(document, (), Task, **given)
    document.check()
    return task


def damper_from_model(
    path: str | Path, v_max: float = 8.0, known_to: float | None = None
) -> DesignDamper:
    """Return the damper of a model.toml: its law with the effects that act in a damper.

    Parameters
    ----------
    path : the file, as a study writes it
    v_max : largest voltage [V]
    known_to : largest speed [m/s] of the data behind the model, None where nobody says

    Raises
    ------
    DesignError
        With every mistake of the file and its line.
    """
    try:
        model = read_model(Path(path))
    except StudyError as error:
        raise DesignError(str(error)) from None
    inside = model.at("damper", bench=not model.building)
    try:
        return DesignDamper(model.law, inside.values, inside.effects, v_max, known_to)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from None


def _damper(document: Document, found: Mapping[str, Any], folder: Path) -> Any:
    table, model = document.data.get("damper", {}), found["model"]
    limits = {name: found[name] for name in ("v_max", "known_to") if found[name] is not None}
    if not model:
        values = found["law"], found["parameters"], found["effects"]
        return _made(document, ("damper",), DesignDamper, *values, **limits)
    if {"law", "parameters", "effects"} & set(table):
        words = "[damper]: give either model or law, parameters, effects."
        document.error(("damper", "model"), words)
        return None
    return _made(document, ("damper",), damper_from_model, folder / model, **limits)


def _made(
    document: Document, keys: KeyPath, make: Callable[..., Any], *args: Any, **given: Any
) -> Any:
    """Return what `make` makes, None after a mistake, which is noted."""
    try:
        return make(*args, **given)
    except (DesignError, PhysicsError) as error:
        text = str(error).removeprefix(f"{keys[0]}: ") if keys else str(error)
        document.error_of(keys, f"[{keys[0]}] {text}" if keys else text)
        return None
