"""The answer of an example, in base64 beside the study: nobody reads it by accident."""

from __future__ import annotations

import base64
import json
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..data.files import write_whole
from ..errors import StudyError

FILE = Path("sealed", "answer.txt")
COVER = "What is hidden in this rig, in base64. To read it:  bristle example reveal FOLDER"


def seal(folder: Path, answer: Mapping[str, Any]) -> None:
    """Write an answer into a study's folder.

    Parameters
    ----------
    folder : Path
        The study.
    answer : mapping
        `rig`, `law`, `noise`, `seed`, `hidden` (names), `about` (name to words), `values`
        (name to value in SI and unit), `base` (the law's values by the library's names, SI),
        `share`, where it is known, [1]; `instruments` (channel to the noise's standard deviation
        in SI).
    """
    code = base64.b64encode(json.dumps(answer).encode()).decode()
    (folder / FILE).parent.mkdir(exist_ok=True)
    write_whole(folder / FILE, "\n".join([COVER, "", *textwrap.wrap(code, 76), ""]))


def unseal(folder: Path) -> dict[str, Any]:
    """Return the answer of an example.

    Raises
    ------
    StudyError
        If the folder holds none, or its text was changed.
    """
    path = folder / FILE
    if not path.is_file():
        raise StudyError(
            f"{folder}: there is no {FILE}. Make an example with  bristle example bench NAME"
        )
    code = path.read_text(encoding="utf-8").partition("\n")[2]
    try:
        answer = json.loads(base64.b64decode("".join(code.split()), validate=True))
    except ValueError as error:
        raise StudyError(f"{path}: its text was changed; make the example again.") from error
    if not isinstance(answer, dict) or "hidden" not in answer:
        raise StudyError(f"{path}: it contains no answer; make the example again.")
    return answer


def told(answer: Mapping[str, Any], found: tuple[str, ...], kind: str) -> str:
    """Return what was hidden and what the study has found, as text.

    Parameters
    ----------
    answer : mapping
        Of `unseal`.
    found : tuple
        Effects of the study's present model, and those that its verdict names.
    kind : str
        The kind of its verdict, "" where there is none.
    """
    hidden = answer["hidden"]
    lines = [f"Hidden: {' and '.join(hidden) or 'nothing'}."]
    lines += [f"  {name}: {about}" for name, about in answer["about"].items()]
    lines += [
        f"    {name:14} {value:.4g} {'' if unit == '1' else unit}".rstrip()
        for name, (value, unit) in answer["values"].items()
    ]
    if answer.get("share"):
        lines.append(f"  It changes the force by {100 * answer['share']:.0f} % of its RMS.")
    base = ", ".join(f"{name} = {value:.4g}" for name, value in answer["base"].items())
    lines += [f"The law is {answer['law']}, in SI units:", f"    {base}"]
    said = " and ".join(found) or "no effect"
    verdict = f'verdict "{kind}"' if kind else "no verdict yet"
    lines += ["", f"Your study: {said}; {verdict}."]
    return "\n".join(lines)
