"""The text of a study.toml with one thing changed, and all else as its user wrote it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..data.channels import ChannelSpec, at_device
from ..data.corrections import Correction, after
from .channel_file import channel_as_toml
from .run_file import EXCLUDE, RunFile, corrections_as_toml, run_as_toml


def with_mask(text: str) -> str:
    """Return the text of a study.toml with `mask = true`, all else as it was."""
    import tomlkit

    document = tomlkit.parse(text)
    if "mask" in document:
        document["mask"] = True
        return tomlkit.dumps(document)
    # Above the first key or below the schema: further down a line may be part of a longer text.
    lines = text.split("\n")
    keys = (k for k, line in enumerate(lines) if line.strip() and line.lstrip()[0] != "#")
    first = next(keys, len(lines))
    first += "".join(lines[first : first + 1]).startswith("schema")
    line = "mask = true # isolated spikes count as not measured"
    return "\n".join([*lines[:first], line, *lines[first:]])


def with_excluded(text: str, files: Sequence[tuple[str, int]]) -> str:
    """Return the text of a study.toml with runs left out from now on, all else as it was.

    Parameters
    ----------
    text : of the file
    files : file and piece of each run, its piece 0 where the file holds one
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    for table in document["runs"]:
        if (table["file"], table.get("piece", 0)) in files:
            before = table.get("role", "train")
            table["role"] = EXCLUDE
            table["role"].comment(f"was {before}")
    return tomlkit.dumps(document)


def with_roles(text: str, roles: Mapping[tuple[str, int], str]) -> str:
    """Return the text of a study.toml with other roles of runs, all else as it was.

    Parameters
    ----------
    text : of the file
    roles : by file and piece of the run, its piece 0 where the file holds one
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    for table in document["runs"]:
        role = roles.get((table["file"], table.get("piece", 0)))
        if role is not None:
            table["role"] = role
    return tomlkit.dumps(document)


def with_runs(text: str, runs: Sequence[RunFile]) -> str:
    """Return the text of a study.toml with more runs after its own, all else as it was."""
    import tomlkit

    document: Any = tomlkit.parse(text)
    for run in runs:
        table = run_as_toml(run)
        table.add(tomlkit.nl())
        document["runs"].append(table)
    return tomlkit.dumps(document)


def with_corrections(text: str, found: Mapping[tuple[str, int], Sequence[Correction]]) -> str:
    """Return the text of a study.toml with more corrections of runs, all else as it was.

    Parameters
    ----------
    text : of the file
    found : corrections by file and piece of the run, its piece 0 where the file holds one
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    for table in document["runs"]:
        corrections = found.get((table["file"], table.get("piece", 0)))
        if corrections is None:
            continue
        known = [Correction(**one) for one in table.unwrap().get("correct", [])]
        table["correct"] = corrections_as_toml([*known, *after(known, corrections)])
    return tomlkit.dumps(document)


def with_channels(
    text: str,
    channels: Mapping[str, ChannelSpec | None],
    extra: Mapping[str, ChannelSpec | None],
    corrections: Mapping[tuple[str, int], Sequence[Correction]],
    device: str = "",
) -> str:
    """Return the text of a study.toml with channels read in another way, all else as it was.

    Comments in the tables of these channels told why they were read as they were: they go.

    Parameters
    ----------
    text : of the file
    channels, extra : where a channel is from now on, None for those that are no longer read
    corrections : those that are left, by file and piece of the runs that lose some
    device : the one that the study is about: its brace_force is called force
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    own = {at_device(name, device): name for name in document["channels"]}
    for key, listed in (("channels", channels), ("extra", extra)):
        for name, spec in listed.items():
            place = own.get(name, name) if key == "channels" else name
            if spec is None:
                document[key].remove(place)
                continue
            if key not in document:
                document.add(key, tomlkit.table(is_super_table=True))
            table = tomlkit.table()
            if key == "channels":
                table.add(tomlkit.comment("given"))
            table.update(channel_as_toml(spec))
            table.add(tomlkit.nl())
            document[key][place] = table
    for table in document["runs"]:
        left = corrections.get((table["file"], table.get("piece", 0)))
        if left:
            table["correct"] = corrections_as_toml(left)
        elif left is not None:
            table.remove("correct")
    return tomlkit.dumps(document).rstrip("\n") + "\n"
