"""The documentation: it renders, its blocks run, what it shows is what the commands print."""

from __future__ import annotations

import argparse
import importlib.util
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import bristle
from benchmarks.paper.figures import paper_figures
from bristle.cli import build_parser
from bristle.cli.list_ import effect_as_dict
from bristle.fmu import catalogue
from bristle.model.equations import formulas
from bristle.physics.effect import EFFECTS
from bristle.physics.laws import laws_of

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"


def load(name: str) -> ModuleType:
    """Return a script of docs/ as a module."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look themselves up there
    spec.loader.exec_module(module)
    return module


DRAWN = "gas_spring"
snippets = load("snippets")
generate = load("generate")
PAGES = {str(page.relative_to(ROOT)): page for page in snippets.all_pages()}


LONG = {f"docs/{name}.md" for name in (
    "controllers", "elsewhere", "flow", "learn", "native", "own_physics", "plan", "shake_table",
    "simulate", "tutorial_bench", "tutorial_code",
)} | {"README.md"}  # fmt: skip
"""Pages whose commands search for effects, run scenarios at several steps, compile what is a
user's own, or build FMUs for a host."""


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=pytest.mark.slow) if p in LONG else p for p in PAGES]
)
@pytest.mark.skipif(sys.platform == "win32", reason="the pages' commands are for a POSIX shell")
def test_what_a_page_shows_is_what_its_commands_print(page: str) -> None:
    assert snippets.run_page(PAGES[page]) > 0


def test_the_readme_and_the_main_pages_are_among_those_that_run() -> None:
    assert {"README.md", "docs/simulate.md", "docs/elsewhere.md", "docs/flow.md"} <= set(PAGES)


@pytest.mark.parametrize(
    ("said", "same"),
    [
        ("a\nb\nc\n", True),
        ("a\n...\nc\n", True),
        ("...\nb\n...\n", True),
        ("a\n...\nb\n", False),
        ("...\nd\n...\n", False),
        ("a\nb\n", False),
    ],
)
def test_an_output_is_compared_line_by_line_but_for_what_is_left_out(said: str, same: bool) -> None:
    assert snippets.same(said, "a\nb\nc\n") is same


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("```python\nprint(1 + 1)\n```\n\n```text\n3\n```\n", "the page says"),
        ("```python\nprint(1 + 1)\n```\n", "no block follows"),
        ("```python\nraise ValueError\n```\n", "a python block fails"),
        ("```console\n$ bristle check gone.toml\n```\n", "gone.toml"),
        ("```console\n$ bristle --version\nbristle 9.9.9\n```\n", "the page says"),
    ],
)
def test_a_page_that_is_wrong_is_found(body: str, words: str, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"# Page\n\n{body}")
    with pytest.raises(snippets.SnippetError, match=words):
        snippets.run_page(page)


def test_a_page_is_brought_up_to_date(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```console\n$ bristle --version\nold\n```\n\n```python\nprint(2)\n```\n\n"
                    "```text\nold\n```\n")  # fmt: skip
    assert snippets.run_page(page, update=True) == 2
    assert f"$ bristle --version\nbristle {bristle.__version__}\n```" in page.read_text()
    assert snippets.run_page(page) == 2


@pytest.mark.slow  # all pages by mkdocs
def test_the_site_renders_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        env={**os.environ, "DOCS_WITHOUT_LIVE": "1"},  # that takes minutes, tests/web makes one
    )
    assert done.returncode == 0, done.stderr
    for path in generate.pages():
        page = tmp_path / "site" / path.removesuffix("index.md").removesuffix(".md")
        assert (page / "index.html").is_file()


@pytest.fixture(scope="module")
def pages() -> Iterator[dict[str, str]]:
    """Return the generated pages; of the effects' pictures, all drawn alike, only one is drawn."""
    effect_pages = sys.modules["effect_pages"]
    draw = effect_pages.picture_of
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            effect_pages, "picture_of", lambda name: draw(name) if name == DRAWN else None
        )
        yield generate.pages()


def test_every_component_has_a_page_with_all_its_ports_and_parameters(
    pages: dict[str, str],
) -> None:
    for name in catalogue.component_names():
        text = pages[f"components/{name}.md"]
        for variable in catalogue.describe(name).variables.values():
            if "." not in variable.name:
                assert f"| `{variable.name}` |" in text
                assert variable.unit is None or f"`{variable.unit}`" in text


def test_every_effect_has_a_page_with_text_parameters_and_source(pages: dict[str, str]) -> None:
    for name, effect in EFFECTS.items():
        text = pages[f"effects/{name}.md"]
        assert effect.first_line() in text
        assert effect.source in text
        assert effect.expect[1:] in text
        body = effect_as_dict(effect)["text"]
        assert len(body) > 60
        prose = [line for line in body.splitlines() if line and not line.startswith("    ")]
        assert all(line in text for line in prose)
        set_ = formulas(effect.__doc__ or "")
        assert set_
        assert all(one in text for one in set_)
        for parameter, about in effect.parameters.items():
            assert f"| `{name}.{parameter}` | {about.value:g} |" in text
    assert f"![Force with and without {DRAWN}]({DRAWN}.png)" in pages[f"effects/{DRAWN}.md"]
    assert sys.modules["effect_pages"].picture_of(DRAWN)[0].startswith(b"\x89PNG")


def test_every_command_has_a_section_with_all_its_options(pages: dict[str, str]) -> None:
    text = pages["cli.md"]
    commands = next(a for a in build_parser()._actions if a.dest == "command").choices
    assert commands is not None
    for name, parser in commands.items():
        _, found, section = text.partition(f"\n## bristle {name}\n")
        assert found, name
        section = section.partition("\n## ")[0]
        for action in parser._actions:
            option = next((one for one in action.option_strings if one.startswith("--")), "")
            if option and action.help != argparse.SUPPRESS and option != "--help":
                assert option in section or f"`{option}`" in text[:400], f"{name} {option}"


def test_every_law_has_a_page_with_its_parameters_and_source(pages: dict[str, str]) -> None:
    for law in laws_of("damper"):
        text = pages[f"laws/{law.name}.md"]
        assert law.source in text
        assert all(f"| `{name}` |" in text for name in law.parameters)


def test_tutorials_need_nothing_of_a_checkout() -> None:
    tutorials = sorted(DOCS.glob("tutorial_*.md"))
    assert len(tutorials) >= 3
    for page in tutorials:
        for block in snippets.blocks(page.read_text(encoding="utf-8")):
            if block.language == "console":
                assert "tests" not in block.body
                assert "$ python " not in block.body


def test_the_first_pages_begin_with_the_picture_and_the_commands_that_make_it() -> None:
    picture = load("first_picture")
    command = " && ".join(f"bristle {one}" for one in picture.COMMANDS)
    for page in (ROOT / "README.md", DOCS / "index.md"):
        beginning = page.read_text(encoding="utf-8")[:1500]
        assert "figures/hidden_effect.png" in beginning
        assert command in beginning
    assert (DOCS / "figures" / "hidden_effect.png").is_file()


def test_tables_of_generated_pages_are_whole(pages: dict[str, str]) -> None:
    for path, text in pages.items():
        for block in re.findall(r"(?:^\|.*\|$\n?)+", text, re.MULTILINE):
            widths = {len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}
            assert len(widths) == 1, f"{path}: {block}"


def links(text: str) -> list[str]:
    prose = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"\]\(([^)#\s]+)[^)]*\)", prose)


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md"])
def test_links_lead_somewhere(name: str) -> None:
    found = links((ROOT / name).read_text(encoding="utf-8"))
    assert found
    for link in found:
        assert link.startswith("https://") or (ROOT / link).exists(), link


def test_every_command_is_documented() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in [*DOCS.glob("*.md")])
    commands = next(a for a in build_parser()._actions if a.dest == "command").choices
    assert commands is not None
    assert [name for name in commands if f"bristle {name}" not in text] == []


def test_every_figure_of_the_paper_has_its_command() -> None:
    text = (DOCS / "physics.md").read_text(encoding="utf-8")
    for name in paper_figures():
        assert f"python -m benchmarks paper figures {name}" in text
        assert f"(figures/{name}.png)" in text
        assert (DOCS / "figures" / f"{name}.png").is_file()


def test_pages_show_the_pictures_that_commands_write_and_no_others_are_kept() -> None:
    gallery = load("gallery")
    made = {one.name for one in (*gallery.BENCH, *gallery.BUILDING) if one.picture}
    text = "".join(
        page.read_text(encoding="utf-8") for page in [ROOT / "README.md", *DOCS.glob("*.md")]
    )
    shown = set(re.findall(r"figures/([\w-]+\.\w+)\)", text))
    assert shown == {path.name for path in (DOCS / "figures").iterdir()}
    assert {f"{name}.png" for name in made} == {one for one in shown if one.startswith("gallery-")}


def test_the_architecture_names_files_that_are_there() -> None:
    head = (DOCS / "architecture.md").read_text(encoding="utf-8").partition("## The map")[0]
    named = re.findall(r"`([a-z_]+/)(?:\{([a-z_,]+)\}|([a-z_]+)(?:\.py)?)`", head.replace("\n", ""))
    files = [folder + name for folder, many, one in named for name in (many or one).split(",")]
    assert len(set(files)) > 40
    assert [name for name in files if not (ROOT / "bristle" / f"{name}.py").is_file()] == []


def test_the_citation_names_this_version_and_the_paper() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {bristle.__version__}\n" in text
    for name in ("Shirazi", "Mohammadpour", "Grigoriadis", "Song", "Control Systems Technology"):
        assert name in text
