"""Runs what the pages show: code blocks as written, their printed output compared line by line.

A block is one of

    ```console                      lines that begin with "$ " are run, the others are output
    ```python                       run after these; a page's blocks share one interpreter
    ```LANGUAGE title="PATH"        written to PATH before the console blocks below it and before
                                    python; a PATH below bristle/ in a copy of the sources
    ```text                         right after a python block: what that block prints

A comment `<!-- needs: MODULE -->` before a block leaves it out where the module is missing,
`<!-- not run: REASON -->` always. In output a line `...` stands for any lines, and times that the
computer took are not compared.

`python docs/snippets.py PAGE ...` runs pages and writes the output they give into them.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
_FENCE = re.compile(
    r"(?:<!-- (?P<word>needs|not run): (?P<what>[^>]*) -->\n+)?"
    r'^```(?P<language>\w+)(?: title="(?P<title>[^"]+)")?\n(?P<body>.*?)^```$',
    re.MULTILINE | re.DOTALL,
)
_CUT = "-- end of block --"
_TOOK = re.compile(r"(?<=rows in |runs in )[\d.]+(?= s)|(?<=guid )[0-9a-f-]{36}")


class SnippetError(Exception):
    """A block that fails, or prints something else than its page says."""


@dataclass
class Block:
    """A fenced block of a page: where its body stands, and what it is."""

    start: int
    end: int
    language: str
    body: str
    title: str | None = None
    needs: str | None = None
    skipped: bool = False
    got: str = field(default="", compare=False)


def all_pages() -> list[Path]:
    """Return the README and every page with blocks that are run."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [
        page
        for page in pages
        if any(
            block.language in ("python", "console") and not block.skipped
            for block in blocks(page.read_text(encoding="utf-8"))
        )
    ]


def blocks(text: str) -> list[Block]:
    """Return the fenced blocks of a page in order."""
    found = []
    for match in _FENCE.finditer(text):
        word = match["word"]
        found.append(
            Block(
                match.start("body"),
                match.end("body"),
                match["language"],
                match["body"],
                match["title"],
                match["what"].strip() if word == "needs" else None,
                word == "not run",
            )
        )
    return found


def run_page(page: Path, update: bool = False) -> int:
    """Run a page's blocks in a folder of its own; return how many were run.

    Raises
    ------
    SnippetError
        If a block fails, or prints something else than the page says and `update` is False.
    """
    text = page.read_text(encoding="utf-8")
    found = blocks(text)
    with tempfile.TemporaryDirectory(prefix="bristle_docs_") as name:
        folder = Path(name)
        environment = _prepare(folder)
        sandbox = (page, found, folder, environment)
        pairs = [*_console(*sandbox), *_python(*sandbox)]
    wrong = [pair for pair in pairs if not same(pair[0].body, pair[1])]
    if update:
        for block, got in sorted(wrong, key=lambda pair: -pair[0].start):
            text = text[: block.start] + got + text[block.end :]
        page.write_text(text, encoding="utf-8")
    elif wrong:
        block, got = wrong[0]
        raise SnippetError(f"{page}: the page says\n{block.body}\nthe command\n{got}")
    return len(pairs)


def same(said: str, got: str) -> bool:
    """Return whether an output is what a page says; `...` stands for any lines."""
    parts = [_TOOK.sub("_", part.strip()) for part in re.split(r"^\.\.\.\n", said, flags=re.M)]
    rest = _TOOK.sub("_", got.strip())
    if len(parts) == 1:
        return parts[0] == rest
    if not rest.startswith(parts[0]) or not rest.endswith(parts[-1]):
        return False
    place = 0
    for part in parts:
        place = rest.find(part, place)
        if place < 0:
            return False
        place += len(part)
    return True


def _prepare(folder: Path) -> dict[str, str]:
    """Lay out scenarios and a `bristle` command; return the environment of the page's commands."""
    shutil.copytree(ROOT / "scenarios", folder / "scenarios")
    command = folder / ".bin" / "bristle"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m bristle.cli "$@"\n')
    command.chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "100", "NO_COLOR": "1"}
    environment["BRISTLE_STATE"] = str(folder / ".state")
    environment["PATH"] = f"{command.parent}{os.pathsep}{os.environ['PATH']}"
    return environment


def _write(block: Block, folder: Path, environment: dict[str, str]) -> None:
    """Write a block to the path that its title names, in a copy of the sources if it is there."""
    assert block.title is not None
    if block.title.startswith("bristle/") and environment["PYTHONPATH"] != str(folder):
        for name in ("bristle", "components"):
            shutil.copytree(
                ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__")
            )
        shutil.copyfile(ROOT / "build_fmus.py", folder / "build_fmus.py")
        environment["PYTHONPATH"] = str(folder)
    target = folder / block.title
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(block.body, encoding="utf-8")


def _python(
    page: Path, found: list[Block], folder: Path, environment: dict[str, str]
) -> Iterator[tuple[Block, str]]:
    """Run the python blocks in one interpreter; yield output blocks and what was printed."""
    code = [
        (i, block)
        for i, block in enumerate(found)
        if block.language == "python" and not block.title and not block.skipped
    ]
    code = [pair for pair in code if not pair[1].needs or _installed(pair[1].needs)]
    if not code:
        return
    body = "".join(f"{block.body}\nprint({_CUT!r})\n" for _, block in code)
    # The binary that PythonFMU builds may abort a process that ends with it loaded.
    body += "import os, sys\nsys.stdout.flush()\nos._exit(0)\n"
    done = _call([sys.executable, "-c", body], folder, environment)
    if done.returncode:
        raise SnippetError(f"{page}: a python block fails:\n{done.stdout}{done.stderr}")
    for (i, block), printed in zip(code, done.stdout.split(f"{_CUT}\n")[:-1], strict=True):
        following = found[i + 1] if i + 1 < len(found) else None
        if following is not None and following.language == "text":
            yield following, printed
        elif printed:
            raise SnippetError(f"{page}: no block follows that holds\n{printed}\nof\n{block.body}")


def _installed(modules: str) -> bool:
    return all(importlib.util.find_spec(name.strip()) for name in modules.split(","))


def _console(
    page: Path, found: list[Block], folder: Path, environment: dict[str, str]
) -> Iterator[tuple[Block, str]]:
    """Write files and run the commands of console blocks, from the top of the page to its end.

    Yields each console block and what it should hold.
    """
    for block in found:
        if block.title:
            _write(block, folder, environment)
        if block.language != "console" or block.skipped:
            continue
        lines = []
        said = re.split(r"^\$ ", block.body, flags=re.MULTILINE)[1:]
        for part in said:
            command, _, output = part.partition("\n")
            done = _call(["bash", "-c", command], folder, environment)
            if done.returncode:
                raise SnippetError(f"{page}: {command}\n{done.stdout}{done.stderr}")
            got = done.stdout.replace(f"{folder}/", "")
            # A command whose output is not shown may print what it likes.
            shown = got if output else ""
            lines.append(f"$ {command}\n{output if same(output, shown) else shown}")
        yield block, "".join(lines)


def _call(
    command: list[str], folder: Path, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    # Tables are padded to their width; pages need no blanks at the ends of lines.
    done.stdout = "".join(f"{line.rstrip()}\n" for line in done.stdout.splitlines())
    return done


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        print(f"{argument}: {run_page(Path(argument), update=True)} blocks")
