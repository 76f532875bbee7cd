"""Lines of keys, against the standard library's reader for what the keys are."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bristle.core.toml_lines import key_lines, repeated_keys
from bristle.errors import ScenarioError

TEXTS = {
    "plain": "a = 1\n\n# c\nb = 'x' # [d]\n",
    "tables": "[a]\nx = 1\n[a.b]\ny = 2\n[c.d]\nz = 3\n",
    "dotted": "a.b.c = 1\na.d = 2\n[t]\nu . v = 3\n",
    "quoted": '"a.b" = 1\n\'c"d\' = 2\n["e.f"."g]"]\nh = 1\n"\\u00e9" = 2\n',
    "inline": 'a = { "b.c" = 1, d = { e = 2, f.g = 3 }, h = {} }\n',
    "arrays": 'a = [1, # ]\n  "]", [2,\n 3], { b = 1 },\n]\nc = 2\n',
    "array of tables": "[[a]]\nb = 1\n[[a]]\nb = 2\n[a.c]\nd = 3\n[[a.e]]\nf = 4\n[g]\nh = 5\n",
    "long texts": 'a = """\nb = 1\n\\""" ""\nc = 2"""""\nd = \'\'\'\n[e]\n\'\'\'\nf = 6\n',
    "dates": "a = 1979-05-27 07:32:00Z\nb = 07:32:00\nc = +1e-3\nd = inf\n",
    "CRLF": "a = 1\r\n[b]\r\nc = 2\r\n",
    "no end of line": "[a]\nb = 1",
    "nothing": "",
}


def paths(value, path=()):
    """Every path of a parsed document."""
    found = {path} if path else set()
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            found |= paths(inner, (*path, key))
    return found


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_the_keys_are_those_of_the_standard_library(text):
    assert set(key_lines(text)) == paths(tomllib.loads(text))


@pytest.mark.parametrize(
    ("name", "path", "line"),
    [
        ("plain", ("b",), 4),
        ("tables", ("a", "b", "y"), 4),
        ("tables", ("c",), 5),
        ("dotted", ("a", "d"), 2),
        ("quoted", ("e.f", "g]", "h"), 4),
        ("quoted", ("e.f", "g]", "é"), 5),
        ("inline", ("a", "d", "f", "g"), 1),
        ("arrays", ("a", 3, "b"), 3),
        ("arrays", ("c",), 5),
        ("array of tables", ("a", 1, "c", "d"), 6),
        ("long texts", ("f",), 8),
        ("CRLF", ("b", "c"), 3),
    ],
)
def test_a_key_has_the_line_on_which_it_stands(name, path, line):
    assert key_lines(TEXTS[name])[path] == line


@given(st.lists(st.text(min_size=1), min_size=1, unique=True), st.integers(0, 3))
def test_any_key_in_quotes_is_found_on_its_line(names, blank):
    def quoted(name):
        return '"' + "".join(f"\\U{ord(letter):08x}" for letter in name) + '"'

    names = [name for name in names if not any(0xD800 <= ord(c) <= 0xDFFF for c in name)]
    gap = "\n" * (blank + 1)
    text = "".join(f"{quoted(name)} = 1{gap}" for name in names)
    expected = {(name,): 1 + k * (blank + 1) for k, name in enumerate(names)}
    assert key_lines(text) == expected


@pytest.mark.parametrize(
    ("text", "path", "line", "first"),
    [
        ("[a]\nb = 1\nc = 2\nb = 3\n", ("a", "b"), 4, 2),
        ("[a.b]\nc = 1\n[a.d]\n[a.b]\n", ("a", "b"), 4, 1),
        ("a = { b = 1,\n  b = 2 }\n", ("a", "b"), 2, 1),
        ("a = 1\na = 2\n[x\n", ("a",), 2, 1),
    ],
)
def test_a_key_written_twice_is_found_with_both_lines(text, path, line, first):
    assert repeated_keys(text)[0] == (path, line, first)


def test_tables_of_an_array_and_tables_around_others_are_no_repetition():
    assert repeated_keys("[[a]]\nb = 1\n[[a]]\nb = 2\n[c.d]\n[c]\ne.f = 1\ne.g = 2\n") == []


def test_what_is_not_toml_is_refused():
    for text in ("a", "[a", "a = ", "= 1", "a = {b", '"\\q" = 1'):
        with pytest.raises(ScenarioError):
            key_lines(text)
