"""The commands that the page may start, from what it asks for: nothing else runs.

Each function takes the options that a page sends, checks them, and returns the words of one
command. Names of studies and files are checked to be names, so that none can be an option or lead
out of the folder.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from ..core.text import command, unknown, written
from ..core.toml_lines import toml_text
from .requests import UPLOADS, RequestError, batch_name, file_name

Options = Mapping[str, Any]

# Design files that the page writes, from the numbers of its form: design/KIND_1.toml and so on.
#
# The page solves nothing: `bristle design` reads such a file, and what it found is beside it.

FOLDER = "design"
KINDS = ("hinf", "lpv")
"""What may be designed."""


class Field(NamedTuple):
    """A number of the form: its unit, what it is, its bounds and where it begins."""

    unit: str
    text: str
    low: float
    high: float
    value: float


FIELDS = {
    "acceleration.gain": Field("s2/m", "weight of the top floor's acceleration", 0.05, 20.0, 1.5),
    "acceleration.corner": Field("rad/s", "the acceleration weighs less above", 1.0, 200.0, 12.0),
    "command.gain": Field("", "weight of a fast command", 0.05, 50.0, 2.0),
    "command.zero": Field("rad/s", "a slower command weighs least", 0.5, 200.0, 15.0),
    "command.pole": Field("rad/s", "a faster command weighs in full", 5.0, 1000.0, 50.0),
    "noise": Field("m/s2", "noise of the measured acceleration", 1e-3, 1.0, 0.04),
    "tau": Field("", "larger than 1; the larger, the slower the controller", 1.01, 10.0, 2.0),
}  # fmt: skip
"""The numbers of a design, by what the design file calls them."""

_NAME = re.compile(rf"({'|'.join(KINDS)})_([0-9]{{1,4}})")


def design_name(text: object) -> str:
    """Return a text that names a design of the page; RequestError if it does not."""
    if not isinstance(text, str) or not _NAME.fullmatch(text):
        raise RequestError(f"a design: {written(text)} is no name of one; hinf_1 is right.")
    return text


def kind_of_design(name: str) -> str:
    """Return the kind of a design by its name."""
    return design_name(name).rpartition("_")[0]


def names_of(folder: Path) -> list[str]:
    """Return the designs of a study, the oldest first."""
    found = [
        match for one in (folder / FOLDER).glob("*.toml") if (match := _NAME.fullmatch(one.stem))
    ]
    return [match[0] for match in sorted(found, key=lambda match: int(match[2]))]


def content_of(kind: object, values: object, building: str, up: str = "../") -> dict[str, Any]:
    """Return the content of a design file.

    Parameters
    ----------
    kind : one of `KINDS`
    values : the numbers of `FIELDS` by name; those that are left out are as they begin
    building : file of the study's building, "" for the two-storey model
    up : from the design file to the folder of the study

    Raises
    ------
    RequestError
        If a name or a number is not right.
    """
    if kind not in KINDS:
        raise RequestError(unknown("kind", str(kind), KINDS))
    if not isinstance(values, Mapping):
        raise RequestError("values: NAME to number is right.")
    for name in values:
        if name not in FIELDS:
            raise RequestError(unknown("number of a design", str(name), FIELDS))
    found = {name: _number(name, values.get(name, one.value)) for name, one in FIELDS.items()}
    content: dict[str, Any] = {"schema": 1, "kind": kind, "tau": found["tau"]}
    if building:
        content["building"] = f"{up}{building}"
    weights: dict[str, Any] = {"noise": found["noise"]}
    for name in ("acceleration", "command"):
        own = {key.partition(".")[2]: v for key, v in found.items() if key.startswith(f"{name}.")}
        weights[name] = own
    return {**content, "weights": weights, "damper": {"model": f"{up}model.toml"}}


def values_of(content: Mapping[str, Any]) -> dict[str, float]:
    """Return the numbers of `FIELDS` that a design file has."""
    flat = {"noise": content.get("weights", {}).get("noise"), "tau": content.get("tau")}
    for name in ("acceleration", "command"):
        for key, value in content.get("weights", {}).get(name, {}).items():
            flat[f"{name}.{key}"] = value
    return {name: float(flat[name]) for name in FIELDS if isinstance(flat.get(name), int | float)}


def write_design(folder: Path, kind: object, values: object, building: str) -> str:
    """Write the next design file of a study; return its name.

    Parameters
    ----------
    folder : of the study
    kind, values, building : as for `content_of`

    Raises
    ------
    RequestError
        As `content_of`.
    StudyError
        If it cannot be written.
    """
    from ..core.files import write_whole  # here: the server starts without numpy

    content = content_of(kind, values, building)
    numbers = [int(name.rpartition("_")[2]) for name in names_of(folder)]
    name = f"{content['kind']}_{max(numbers, default=0) + 1}"
    write_whole(folder / FOLDER / f"{name}.toml", toml_text(content))
    return name


def _number(name: str, value: object) -> float:
    low, high = FIELDS[name].low, FIELDS[name].high
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise RequestError(f"{name}: {written(value)}; a number is right.")
    if not low <= value <= high:
        raise RequestError(f"{name} = {value:g}: {low:g} to {high:g} is right.")
    return float(value)


# Comparisons of controllers that the page orders: STUDY/comparisons/1 and so on.
#
# The page compares nothing: `bristle controllers` does, and what it found is in such a folder.

COMPARISONS = "comparisons"
COMPARED_MOTIONS = 12
"""Ground motions that one comparison may have."""
MEMBERS = 200
"""Members that a worst case may have."""
COMPARED_PEAK = 3.0
"""Largest peak [g] to which a motion may be scaled."""

_PLAIN_NAME = re.compile(r"[A-Za-z]\w{0,79}")
_NUMBER = re.compile(r"[1-9][0-9]{0,3}")


def numbers_of(folder: Path) -> list[int]:
    """Return the numbers of a study's comparisons, the oldest first, finished or not."""
    found = (folder / COMPARISONS).glob("*/")
    return sorted(int(one.name) for one in found if _NUMBER.fullmatch(one.name))


def _controllers(study: str, options: Options) -> list[str]:
    """Return the words of `bristle controllers` for what a page asks for.

    Parameters
    ----------
    study : whose folder keeps the comparison
    options : `number` of the comparison; `motions`, each a `record` with its `peak` [g], None as
        recorded; `controllers` of the library; `designs` of the study; `damper` a study, ""
        for the library's; `building` a file of a study, "" for the library's, and `device` of it;
        `members` of the worst case, 0 without; `limit`

    Raises
    ------
    RequestError
        If one of them is not right.
    """
    motions = [_motion(one) for one in _list(options, "motions")]
    if not 1 <= len(motions) <= COMPARED_MOTIONS:
        raise RequestError(
            f"motions: {len(motions)}; 1 to {COMPARED_MOTIONS} ground motions are right."
        )
    controllers = [_plain_name("controllers", one) for one in _list(options, "controllers")]
    designs = [design_name(one) for one in _list(options, "designs")]
    chosen = [*controllers, *(f"{study}/{FOLDER}/{name}.json" for name in designs)]
    if not chosen:
        raise RequestError("controllers: none is chosen; one or more are right.")
    found = ["controllers", *_place(options), "--motions", *motions, "--controller", *chosen]
    if options.get("damper"):
        found.append(f"--damper={file_name(options['damper'], 'the damper')}")
    if members := _whole(options, "members", 0, MEMBERS):
        found.append(f"--ensemble={members}")
    if options.get("limit") is True:
        found.append("--limit")
    return [*found, f"--out={study}/{COMPARISONS}/{_whole(options, 'number', 1, 9999)}"]


def _place(options: Options) -> list[str]:
    """Return the words about the building and where its damper is."""
    building, device = options.get("building"), options.get("device")
    if not building:
        return []
    if not isinstance(building, str):
        raise RequestError(f"building: {written(building)}; STUDY/FILE is right.")
    path = "/".join(file_name(part, "the building") for part in building.split("/"))
    return [
        f"--building={path}",
        *([f"--device={_plain_name('device', device)}"] if device else []),
    ]


def _motion(asked: object) -> str:
    """Return a ground motion as the command takes it."""
    if not isinstance(asked, Mapping):
        raise RequestError(f"motions: {written(asked)}; a record with its peak is right.")
    text, peak = record_name(asked.get("record")), asked.get("peak")
    return text if peak is None else f"{text},peak={peak_of(text, peak):.6g}g"


def record_name(record: object) -> str:
    """Return the name of a ground motion, or a dropped file's; RequestError if it is neither."""
    if isinstance(record, str) and record.startswith(f"{UPLOADS}/") and record.count("/") == 2:
        _, batch, name = record.split("/")
        return f"{UPLOADS}/{batch_name(batch)}/{file_name(name, 'the record')}"
    return _plain_name("motions", record)


def peak_of(motion: str, peak: object) -> float:
    """Return the peak [g] to which a ground motion is scaled; RequestError if it cannot be."""
    if isinstance(peak, bool) or not isinstance(peak, int | float) or not isfinite(peak):
        raise RequestError(f"{motion}: peak = {written(peak)}; a number in g is right.")
    if not 0.0 < peak <= COMPARED_PEAK:
        raise RequestError(
            f"{motion}: peak = {peak:g} g; above 0, to {COMPARED_PEAK:g} g, is right."
        )
    return float(peak)


def _list(options: Options, key: str, of: str = "") -> list[Any]:
    found = options.get(key, [])
    if not isinstance(found, list):
        raise RequestError(f"{key}: {written(found)}; a list{of and f' of {of}'} is right.")
    return found


def _plain_name(key: str, text: object) -> str:
    if not isinstance(text, str) or not _PLAIN_NAME.fullmatch(text):
        raise RequestError(f"{key}: {written(text)}; a name is right.")
    return text


def _whole(options: Options, key: str, low: int, high: int) -> int:
    value = options.get(key, 0)
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise RequestError(f"{key}: {written(value)}; a whole number, {low} to {high}, is right.")
    return value


_WORD = re.compile(r"[A-Za-z][\w.]{0,79}")


@dataclass(frozen=True)
class Order:
    """A command: the study that it is about, what it is called, and its words behind `bristle`."""

    study: str
    what: str
    words: tuple[str, ...]

    @property
    def shown(self) -> str:
        """The command line as a shell takes it."""
        return command(*self.words)


def order_of(what: object, study: object, options: Options) -> Order:
    """Return the command that a page asks for.

    Parameters
    ----------
    what : its name: one of `COMMANDS`
    study : the name of a folder
    options : as the function of the command takes them

    Raises
    ------
    RequestError
        If there is no such command, or a name or an option is not right.
    """
    if what not in COMMANDS:
        raise RequestError(unknown("command", str(what), COMMANDS))
    name = file_name(study, "the study")
    return Order(name, str(what), tuple(COMMANDS[what](name, options)))


def _word(options: Options, key: str) -> list[str]:
    """Return a name among the options in a list, empty where there is none."""
    text = options.get(key)
    if text in (None, ""):
        return []
    if not isinstance(text, str) or not _WORD.fullmatch(text):
        raise RequestError(f"{key}: {written(text)}; a name is right.")
    return [text]


def _words(options: Options, key: str) -> list[str]:
    """Return a list of names among the options."""
    return [one for text in _list(options, key, "names") for one in _word({key: text}, key)]


def _option(name: str, values: Sequence[str]) -> list[str]:
    return [f"--{name}", *values] if values else []


def _flags(options: Options, *names: str) -> list[str]:
    return [f"--{name}" for name in names if options.get(name) is True]


def _text(options: Options, key: str, most: int = 120) -> str:
    text = options.get(key, "")
    if not isinstance(text, str) or len(text) > most or not (text.isprintable() or not text):
        raise RequestError(f"{key}: a line of at most {most} characters is right.")
    return text.strip()


def _example(study: str, options: Options) -> list[str]:
    rig = options.get("rig")
    if rig not in ("bench", "building"):
        raise RequestError(f'rig: {written(rig)}; "bench" or "building" is right.')
    seed = options.get("seed", 1)
    if not isinstance(seed, int) or not 0 <= seed < 10**6:
        raise RequestError(f"seed: {written(seed)}; a whole number is right.")
    own = [] if seed == 1 else ["--seed", str(seed)]
    return ["example", str(rig), study, *own]


def _new(study: str, options: Options) -> list[str]:
    folder = f"{UPLOADS}/{batch_name(options.get('batch'))}"
    words = ["study", "new", study, "--data", folder]
    words += _building(options, folder)
    words += _channel_words(options)
    words += _option("law", _word(options, "law"))
    step = options.get("step")
    if step is not None:
        if not isinstance(step, int | float) or not step > 0.0:
            raise RequestError(f"step: {written(step)}; seconds above 0 are right.")
        words.append(f"--step={step:g}")
    return words


def _channel_words(options: Options) -> list[str]:
    """Return the words about where channels are."""
    texts = _list(options, "channels", "CHANNEL=COLUMN@UNIT")
    for text in texts:
        if not isinstance(text, str) or not text.isprintable() or len(text) > 300:
            raise RequestError(f"channels: {written(text)}; CHANNEL=COLUMN@UNIT is right.")
    return [f"--channel={text}" for text in texts]


def _channels(study: str, options: Options) -> list[str]:
    words = _channel_words(options)
    words += [f"--without={name}" for name in _words(options, "without")]
    if not words:
        raise RequestError("channels: name one or more; nothing would change.")
    return ["study", "channels", study, *words]


def _building(options: Options, folder: str) -> list[str]:
    """Return the words about the building of a new study, none of a bench."""
    if options.get("building") in (None, ""):
        return []
    file = file_name(options["building"], "the building's file")
    return ["--rig", "structure", "--building", f"{folder}/building/{file}"]


def _roles(study: str, options: Options) -> list[str]:
    words = ["study", "roles", study]
    for role in ("train", "holdout", "test", "exclude"):
        runs = _list(options, role, "runs")
        for run in runs:
            if not isinstance(run, str) or not run.isprintable() or len(run) > 200:
                raise RequestError(f"{role}: {written(run)} is no run.")
        words += [f"--{role}={run}" for run in runs]
    return words


def _add(study: str, options: Options) -> list[str]:
    effects = _words(options, "effects")
    if not effects:
        raise RequestError("effects: name one or more.")
    why = _text(options, "why")
    return ["add", study, *effects, *([f"--why={why}"] if why else [])]


def _design(study: str, options: Options) -> list[str]:
    name = design_name(options.get("name"))
    return ["design", kind_of_design(name), f"{study}/{FOLDER}/{name}.toml",
            f"--out={study}/{FOLDER}/{name}.json"]  # fmt: skip


def _export_ssp(study: str, options: Options) -> list[str]:
    """Return the command that packs a scenario which `bristle export` wrote."""
    file = file_name(options.get("scenario"), "the scenario")
    stem, dot, ending = file.rpartition(".")
    if ending != "toml" or not stem:
        raise RequestError(f"scenario: {written(file)}; a .toml file of export/ is right.")
    return ["export-ssp", f"{study}/export/{file}", f"--out={study}/export/{stem}{dot}ssp"]


def _plain(
    *before: str, words: Sequence[str] = (), texts: Sequence[str] = (), flags: Sequence[str] = ()
) -> Callable[[str, Options], list[str]]:
    """Return the function of a command that takes the study, and options by their own names."""

    def found(study: str, options: Options) -> list[str]:
        named = [word for key in words for word in _option(key, _word(options, key))]
        given = [f"--{key}={text}" for key in texts if (text := _text(options, key, 30))]
        return [*before, study, *named, *given, *_flags(options, *flags)]

    return found


PLANNED = ("stroke", "speed", "acceleration", "force", "heat", "duration")
"""Options of `bristle plan` that the page may set."""
COMMANDS: dict[str, Callable[[str, Options], list[str]]] = {
    "add": _add,
    "auto": _plain("study", "auto", flags=("learn",)),
    "channels": _channels,
    "check": _plain("study", "check", flags=("mask", "correct")),
    "controllers": _controllers,
    "design": _design,
    "diagnose": _plain("diagnose", words=("law",)),
    "example": _example,
    "export": _plain("export"),
    "export_ssp": _export_ssp,
    "identify": _plain("identify", words=("law", "command")),
    "learn": _plain("learn"),
    "new": _new,
    "plan": _plain("plan", texts=PLANNED),
    "report": _plain("report"),
    "reveal": _plain("example", "reveal"),
    "roles": _roles,
    "undo": _plain("undo"),
}
"""What the page may ask for."""
