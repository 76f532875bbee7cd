"""The commands that the page may start, from what it asks for: nothing else runs.

Each function takes the options that a page sends, checks them, and returns the words of one
command. Names of studies and files are checked to be names, so that none can be an option or lead
out of the folder.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..findings import command, unknown, written
from . import comparisons
from .designs import FOLDER as DESIGNS
from .designs import design_name, kind_of_design
from .message import RequestError
from .names import UPLOADS, batch_name, file_name

_WORD = re.compile(r"[A-Za-z][\w.]{0,79}")
_SET = re.compile(r"[A-Za-z][\w.\[\]]{0,99}=\w[\w .+-]*(/\w[\w .+-]*)*|[\w.\[\]]{1,100}=-[\d.e+-]+")

Options = Mapping[str, Any]


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
    texts = options.get(key, [])
    if not isinstance(texts, list):
        raise RequestError(f"{key}: {written(texts)}; a list of names is right.")
    return [one for text in texts for one in _word({key: text}, key)]


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
    texts = options.get("channels", [])
    if not isinstance(texts, list):
        raise RequestError(f"channels: {written(texts)}; a list of CHANNEL=COLUMN@UNIT is right.")
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


def _check(study: str, options: Options) -> list[str]:
    return ["study", "check", study, *_flags(options, "mask", "correct")]


def _roles(study: str, options: Options) -> list[str]:
    words = ["study", "roles", study]
    for role in ("train", "holdout", "test", "exclude"):
        runs = options.get(role, [])
        if not isinstance(runs, list):
            raise RequestError(f"{role}: {written(runs)}; a list of runs is right.")
        for run in runs:
            if not isinstance(run, str) or not run.isprintable() or len(run) > 200:
                raise RequestError(f"{role}: {written(run)} is no run.")
        words += [f"--{role}={run}" for run in runs]
    return words


def _identify(study: str, options: Options) -> list[str]:
    law, form = _word(options, "law"), _word(options, "command")
    return ["identify", study, *_option("law", law), *_option("command", form)]


def _diagnose(study: str, options: Options) -> list[str]:
    law = _word(options, "law")
    return ["diagnose", study, *_option("law", law), *_flags(options, "limits")]


def _add(study: str, options: Options) -> list[str]:
    effects = _words(options, "effects")
    if not effects:
        raise RequestError("effects: name one or more.")
    why = _text(options, "why")
    return ["add", study, *effects, *([f"--why={why}"] if why else [])]


def _plan(study: str, options: Options) -> list[str]:
    words = ["plan", study]
    for name in ("stroke", "speed", "acceleration", "force", "heat", "duration"):
        if text := _text(options, name, 30):
            words.append(f"--{name}={text}")
    return words


def _auto(study: str, options: Options) -> list[str]:
    return ["study", "auto", study, *_flags(options, "learn")]


def _design(study: str, options: Options) -> list[str]:
    name = design_name(options.get("name"))
    return ["design", kind_of_design(name), f"{study}/{DESIGNS}/{name}.toml",
            f"--out={study}/{DESIGNS}/{name}.json"]  # fmt: skip


def _passive(study: str, options: Options) -> list[str]:
    """Return the command that finds the best constant voltage on the motions of a closed loop."""
    sets = options.get("sets", [])
    if not isinstance(sets, list) or not all(isinstance(one, str) for one in sets):
        raise RequestError(f"sets: {written(sets)}; a list of NAME=VALUE is right.")
    for one in sets:
        if not _SET.fullmatch(one):
            raise RequestError(f"sets: {written(one)}; NAME=VALUE is right.")
    records = options.get("motions")
    if not isinstance(records, list) or not records:
        raise RequestError(f"motions: {written(records)}; a list of ground motions is right.")
    motions = [comparisons.record_name(one) for one in records]
    peak = comparisons.peak_of("motions", options.get("peak"))
    words = ["optimise", "passive", "--motions", *motions, f"--intensities={peak:g}"]
    words += ["--grid", "33", f"--out={study}/{DESIGNS}/passive", "--no-figure"]
    return [*words, *(word for one in sets for word in ("--set", one))]


def _export_ssp(study: str, options: Options) -> list[str]:
    """Return the command that packs a scenario which `bristle export` wrote."""
    file = file_name(options.get("scenario"), "the scenario")
    stem, dot, ending = file.rpartition(".")
    if ending != "toml" or not stem:
        raise RequestError(f"scenario: {written(file)}; a .toml file of export/ is right.")
    return ["export-ssp", f"{study}/export/{file}", f"--out={study}/export/{stem}{dot}ssp"]


def _simple(*before: str) -> Callable[[str, Options], list[str]]:
    """Return the function of a command that takes the study alone."""
    return lambda study, options: [*before, study]


COMMANDS: dict[str, Callable[[str, Options], list[str]]] = {
    "add": _add,
    "auto": _auto,
    "channels": _channels,
    "check": _check,
    "controllers": comparisons.words,
    "design": _design,
    "diagnose": _diagnose,
    "example": _example,
    "export": _simple("export"),
    "export_ssp": _export_ssp,
    "identify": _identify,
    "learn": _simple("learn"),
    "new": _new,
    "passive": _passive,
    "plan": _plan,
    "report": _simple("report"),
    "reveal": _simple("example", "reveal"),
    "roles": _roles,
    "undo": _simple("undo"),
}
"""What the page may ask for."""
