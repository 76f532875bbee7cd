"""What a check finds, and how it words it: the nearest right names, values as they were written."""

from __future__ import annotations

import math
import shlex
import sys
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Literal, NamedTuple

Level = Literal["error", "warning", "note"]
LIST_AT_MOST = 12
"""Longer lists of names are cut down to the nearest few."""
LINES, CHARACTERS = 10, 1000
"""Size of a message at most."""
LIST_LONGEST = 300
"""Characters of a list of names at most."""


class Finding(NamedTuple):
    """One finding of a check. `line` 0 stands for the whole file, or for an override."""

    line: int
    level: Level
    text: str


def worded(file: object, finding: Finding) -> str:
    """Return a finding as one line that begins with its place, `FILE:LINE: text`."""
    place = f"{file}:{finding.line}" if finding.line else str(file)
    return finding.text if finding.text.startswith(f"{place}: ") else f"{place}: {finding.text}"


def nearest(name: str, names: Iterable[str], count: int = 1) -> list[str]:
    """Return the names most like `name`, upper and lower case alike, best first."""
    folded: dict[str, str] = {}
    for candidate in names:
        folded.setdefault(candidate.casefold(), candidate)
    matches = get_close_matches(name.casefold(), folded, n=count, cutoff=0.6)
    return [folded[match] for match in matches]


def listed(names: Iterable[str], most: int = LIST_AT_MOST) -> str:
    """Return names parted by commas, the first ones and a count of the rest where they are many.

    Parameters
    ----------
    names : iterable of str
        Names, in quotes where they need them.
    most : int
        How many are named at most.
    """
    names = list(names)
    shown = names[:most]
    # Titles may be as long as a line each.
    while len(shown) > 1 and len(", ".join(shown)) > LIST_LONGEST:
        shown = shown[:-1]
    rest = len(names) - len(shown)
    return ", ".join(shown) + (f" and {rest} more" if rest else "")


def cut_short(text: str, beside: Sequence[str] = (), way: str = "") -> str:
    """Return a message of `LINES` lines and `CHARACTERS` at most, with a count of what is left out.

    The last guard: who lists what a file holds uses `listed`.

    Parameters
    ----------
    text : the message
    beside : lines that are printed with it, and count as well
    way : how to see all, such as "--json"
    """
    end = f"; all:  {way}" if way else "."
    lines = text.split("\n")
    most = LINES - len(beside)
    kept = lines if len(lines) <= most else lines[: most - 1]
    size = CHARACTERS - sum(len(one) + 1 for one in beside)
    room = size - 60  # what is said of the rest takes the others
    if len("\n".join(kept)) > (size if kept is lines else room):
        while len(kept) > 1 and len("\n".join(kept)) > room:
            kept = kept[:-1]
        if len(kept[0]) > room:
            rest = len(text) - room
            return f"{kept[0][:room]} ... and {rest:,} more characters{end}"
    rest = len(lines) - len(kept)
    told = [f"  ... and {rest:,} more line{'s' * (rest > 1)}{end}"] if rest else []
    return "\n".join([*kept, *told])


def unknown(what: str, name: str, names: Iterable[str], more: str = "") -> str:
    """Return the words for a name that is not there, with what would be right.

    Parameters
    ----------
    what, name : str
        Kind of thing and the name that was written.
    names : iterable of str
        All names that there are.
    more : str
        Where to read them all, for lists too long to print.
    """
    names = list(names)
    close = nearest(name, names)
    words = f'there is no {what} "{name}".'
    if close:
        words += f' Did you mean "{close[0]}"?'
    if not names:
        words += " There are none."
    elif len(names) <= LIST_AT_MOST:
        words += f" There are: {', '.join(names)}."
    else:
        others = dict.fromkeys((*nearest(name, names, 3), *names))
        some = [one for one in others if one not in close[:1]][:3]
        words += f" There are {len(names)}, among them {', '.join(some)}."
        if more:
            words += f" All: {more}"
    return words


def written(value: object) -> str:
    """Return the words for a value as somebody wrote it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'the text "{value if len(value) <= 60 else value[:57] + "..."}"'
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, int) and abs(value) > 10**20:
        return "a whole number beyond all bounds"
    return str(value)


def number(value: object) -> float | str:
    """Return a finite number as float, or the words for why the value is none."""
    if isinstance(value, str):
        try:
            float(value)
        except ValueError:
            return f"is {written(value)}, not a number"
        return f"is {written(value)}, and a number needs no quotes"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"is {written(value)}, not a number"
    try:
        result = float(value)
    except OverflowError:
        return f"is {written(value)}"
    return result if math.isfinite(result) else f"is {result}, not a finite number"


def capital(note: str, files: Iterable[str]) -> str:
    """Return a note as a sentence begins; the name of a file that it begins with stays as it is.

    Parameters
    ----------
    note : the words
    files : names or paths of the files, with / between folders
    """
    if note.startswith(tuple(file.rpartition("/")[2] for file in files)):
        return note
    return note[:1].upper() + note[1:]


def command(*words: object) -> str:
    """Return a `bristle` command as a shell reads it: what holds a space is quoted.

    Parameters
    ----------
    *words : what follows `bristle`: texts and paths
    """
    texts = ["bristle", *(str(word) for word in words)]
    if sys.platform != "win32":
        return shlex.join(texts)
    from subprocess import list2cmdline

    return list2cmdline(texts)
