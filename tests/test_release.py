"""What a release says of itself: one version, bounds that were tried, files for a public host."""

from __future__ import annotations

import pkgutil
import re
import tomllib
from pathlib import Path
from typing import Any

import yaml

from bristle import cli
from bristle.version import DATE, __version__

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "compatibility.md").read_text(encoding="utf-8")
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS: dict[str, list[str]] = PROJECT["project"]["optional-dependencies"]
OF_USERS = ("design", "formats", "records", "native")


def parts(requirement: str) -> tuple[str, dict[str, str]]:
    """Return name and bounds of a requirement."""
    name = re.match(r"[\w-]+", requirement)
    assert name is not None
    return name[0].lower(), dict(re.findall(r"(>=|<)([\d.]+)", requirement.partition(";")[0]))


def test_citation_and_package_have_one_version_and_date() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert str(cited["version"]) == __version__
    assert str(cited["date-released"]) == DATE


def test_every_requirement_has_bounds_and_the_lowest_one_is_tried() -> None:
    lines = (ROOT / "tests" / "lowest.txt").read_text(encoding="utf-8").splitlines()
    pinned = [line.partition("#")[0].strip().lower() for line in lines]
    tried = dict(line.split("==") for line in pinned if line)
    needed = [*PROJECT["project"]["dependencies"], *EXTRAS["design"], *EXTRAS["formats"]]
    for name, bounds in map(parts, needed):
        assert bounds.keys() == {">=", "<"}, name
        assert (tried[name] + ".").startswith(bounds[">="] + "."), name


def test_the_page_lists_commands_extras_and_packages() -> None:
    names = [one.name.strip("_").replace("_", "-") for one in pkgutil.iter_modules(cli.__path__)
             if not one.name.startswith("_")]  # fmt: skip
    row = next(line for line in PAGE.splitlines() if line.startswith("| commands"))
    assert re.findall(r"`([a-z-]+)`", row.partition(":")[0]) == sorted(names)
    for extra in EXTRAS:
        assert f"`{extra}`" in PAGE
    for requirement in [
        *PROJECT["project"]["dependencies"],
        *(r for e in OF_USERS for r in EXTRAS[e]),
    ]:
        assert parts(requirement)[0] in PAGE.lower()


def test_files_for_a_host_are_whole_and_name_what_there_is() -> None:
    files = sorted((ROOT / ".github").rglob("*.yml"))
    assert len(files) == 6
    for file in files:
        text = file.read_text(encoding="utf-8")
        assert isinstance(yaml.safe_load(text), dict), file
        for path in re.findall(r"\b(?:tests|docs|bristle)/[\w./]+\.(?:py|txt|md)", text):
            assert (ROOT / path).is_file(), f"{file}: {path}"
        for extra in re.findall(r"\.\[([\w,]+)\]", text):
            assert set(extra.split(",")) <= EXTRAS.keys(), file
    for name in ("SECURITY.md", "CODE_OF_CONDUCT.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert "http" not in text
        assert "@" not in text
    assert "bristle bug-report" in (ROOT / ".github/ISSUE_TEMPLATE/bug.yml").read_text()
