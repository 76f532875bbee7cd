"""The commands that make a study again: from its files, step by step, to its report."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from ..core.text import command
from ..physics.forms import split_form
from ..study.read_again import devices_of
from ..study.study_file import TEST

if TYPE_CHECKING:
    from ..data.channels import ChannelSpec
    from ..study.history import Step
    from ..study.study import Study

AGAIN = "_again"
"""What the name of the study that is made anew ends with."""


def commands(study: Study) -> list[str]:
    """Return the lines of a shell that make a study again beside it, from the folder above.

    What the history did by hand is copied; everything else is computed anew.
    """
    old = study.name
    new = old + AGAIN
    lines = [_new(study, old, new)]
    read = {run.file for run in study.settings.runs}
    # What is left out may be what no command can read.
    for out in dict.fromkeys(run.file for run in study.settings.excluded):
        if out not in read:
            lines.append(_copy(f"{old}/{out}", f"{new}/{out}"))
    lines.append(_copy(f"{old}/study.toml", f"{new}/study.toml"))
    own_laws = sorted(study.laws_folder.glob("*.py"))
    if own_laws:  # `study new` makes a folder for effects alone
        lines.append(shlex.join(["mkdir", "-p", f"{new}/laws"]))
    for file in (*own_laws, *sorted(study.effects_folder.glob("*.py"))):
        place = f"{file.parent.name}/{file.name}"
        lines.append(_copy(f"{old}/{place}", f"{new}/{place}"))
    lines.append(command("study", "check", new))
    law = ""
    for step in study.steps():
        present = study.model_of(step.number, to_show=True).law
        lines += _step(step, old, new, law, present)
        law = present
    return [*lines, *(command(word, new) for word in ("compare", "diagnose", "report"))]


def _new(study: Study, old: str, new: str) -> str:
    """Return the command that makes the study; its channels are given, not guessed again."""
    settings = study.settings
    files = dict.fromkeys(f"{old}/{run.file}" for run in settings.runs)
    words = ["study", "new", new, "--data", *files]
    test = dict.fromkeys(f"{old}/{run.file}" for run in settings.runs if run.role == TEST)
    words += ["--test", *test] if test else []
    if settings.split:
        words += ["--split", settings.split]
    if settings.rig != "bench":
        words += ["--rig", settings.rig]
    if study.history.model_file(0).is_file():
        model = study.model_of(0, to_show=True)
        words += ["--law", split_form(model.law)[0]]
        if model.building:
            words += ["--building", f"{old}/{model.building}"]
            if len(devices_of(study.folder, settings)[1]) > 1:
                words += ["--device", settings.device]
    for name, spec in settings.channels.items():
        words += _channel(name, spec)
    return command(*words)


def _channel(name: str, spec: ChannelSpec) -> list[str]:
    if spec.step is not None:
        return ["--step", f"{spec.step:g}"]
    unit = f"@{spec.unit}" if spec.unit else ""
    return ["--channel", f"{name}={'-' if spec.sign < 0 else ''}{spec.column}{unit}"]


def _step(step: Step, old: str, new: str, law: str, present: str) -> list[str]:
    """Return what makes a step of the history again; nothing for the first model.

    `law` is that of the model before the step, `present` that of its own.
    """
    verb, _, rest = step.what.partition(" ")
    if verb == "begin":
        return []
    if verb == "add":
        return [command("add", new, *rest.split(", "))]
    if step.what == "identify the building":
        return [command("identify", new, "--structure")]
    if verb == "identify":
        # Not by the step's words: they name a table without its knots.
        options = _other_law(law, present) if present != law else []
        return [command("identify", new, *options)]
    return [_copy(f"{old}/history/{step.number:03d}/model.toml", f"{new}/model.toml")]


def _other_law(law: str, other: str) -> list[str]:
    """Return the options that lead from a law to another one, or to another form of it."""
    (before, _, _), (after, form, _) = split_form(law), split_form(other)
    named = ["--law", after] if after != before or not form else []
    return named + (["--command", form] if form else [])


def _copy(source: str, target: str) -> str:
    return shlex.join(["cp", source, target])
