"""`bristle study channels`: which column each channel of a study is, in which unit and sign."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ._files import channels_of

if TYPE_CHECKING:
    from ..study.channel_changes import CorrectedChannels
    from ..study.study import Study


def add_channels(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bristle study channels`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the study")
    parser.add_argument(
        "--channel", action="append", default=[], metavar="CHANNEL=COLUMN@UNIT",
        help="new column of a channel; a minus before COLUMN reverses its sign: --channel "
        "'force=-Ch3@kN'; without @UNIT the unit stays, or is that of the title",
    )  # fmt: skip
    parser.add_argument(
        "--without", action="append", default=[], metavar="CHANNEL",
        help="do not read this channel any more",
    )  # fmt: skip
    parser.add_argument(
        "--step", type=float, metavar="S", help="sampling step in s of files without a time"
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="show the changes, and write nothing"
    )
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    parser.set_defaults(act=_channels)


def _channels(arguments: argparse.Namespace) -> int:
    """Correct the channels that are named; without any print them all."""
    from ..data.channels import ChannelSpec
    from ..errors import StudyError
    from ..study.channel_changes import correct_channels
    from ..study.study import Study

    study = Study(arguments.folder)
    channels = channels_of(arguments.channel)
    if arguments.step is not None:
        if "time" in channels:
            raise StudyError("--step and --channel time=... exclude each other.")
        channels["time"] = ChannelSpec(step=arguments.step)
    if not channels and not arguments.without:
        _print_channels(study, as_json=arguments.json)
        return 0
    dry = arguments.dry_run
    done = correct_channels(study, channels, without=arguments.without, write=not dry)
    if arguments.json:
        _print_json(study, done)
    else:
        _print(study, done, dry)
    return 0


def _print_channels(study: Study, *, as_json: bool) -> None:
    import json
    from dataclasses import asdict

    from ..study.channel_file import spec_text

    listed = study.settings.channels
    if as_json:
        print(json.dumps({name: asdict(spec) for name, spec in listed.items()}, indent=2))
        return
    for name, spec in listed.items():
        print(f"{name:28} {spec_text(spec)}")


def _print_json(study: Study, done: CorrectedChannels) -> None:
    import json
    from dataclasses import asdict

    answer = {
        "folder": str(study.folder.absolute()),
        "changes": [asdict(one) for one in done.changes],
        "notes": list(done.notes),
        "set_aside": done.results.sentences() if done.changes else [],
        "beside": list(done.results.beside),
        "kept": str(done.kept.absolute()) if done.kept else None,
    }
    print(json.dumps(answer, indent=2, ensure_ascii=False))


def _print(study: Study, done: CorrectedChannels, dry: bool) -> None:
    """Print what changes, what is no longer of the data, and the next command."""
    from ..findings import command

    if not done.changes:
        print(f"{study.folder}: the channels are so already. Nothing is written.")
        return
    runs = len(study.settings.runs)
    what = "would change" if dry else "are corrected"
    print(f"{study.folder}: channels {what}; {runs} run{'s' * (runs != 1)} read by them.")
    for one in done.changes:
        print(f"  {one.channel:16} {one.text}")
    for note in done.notes:
        print(f"{note[:1].upper()}{note[1:]}.")
    lost = done.results.sentences()
    if lost:
        kept = "it would be set aside" if dry else f"kept in {done.kept}"
        print(f"No longer of these data, {kept}:", *lost, sep="\n  ")
    if beside := done.results.beside_text():
        print(beside)
    if not dry:
        print(f"Next:  {command('study', 'check', study.folder)}")
