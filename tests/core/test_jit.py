"""Compiled code is kept on disk, and never outlives the source that it was made from."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import bristle
from bristle.core import jit
from bristle.core.jit import digest

PACKAGE = Path(bristle.__file__).resolve().parent
OLD = "return p.preload + q.x * (p.k + q.x * (p.k_2 + q.x * p.k_3))"
NEW = "return p.preload + 3.0 * q.x * p.k"

# The force is called through a function in another file than its own, as the time loop does.
PROGRAM = """
import json
from collections import namedtuple
from pathlib import Path

from bristle.core.jit import compiled, digest
from bristle.engine.time_loop import integrate
from bristle.physics.effects.gas_spring import GasSpring

Motion = namedtuple("Motion", "x")
Values = namedtuple("Values", "preload k k_2 k_3")
spring = GasSpring.force


def pull(x):
    return spring(Motion(x), 0.0, Values(1.0, 80.0, 0.0, 0.0))


fast = compiled(pull)
force = fast(0.01)
hits = sum(fast.stats.cache_hits.values())
file = digest.__code__.co_filename
print(json.dumps({"force": force, "hits": hits, "loop": digest(integrate), "file": file}))
"""


@pytest.fixture
def edited(tmp_path: Path) -> Any:
    """Return a function that runs the program on a copy of the package with an effect replaced."""
    copy = tmp_path / "library" / "bristle"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PACKAGE, copy, ignore=ignored)
    program = tmp_path / "program.py"
    program.write_text(PROGRAM, encoding="utf-8")
    effect = copy / "physics" / "effects" / "gas_spring.py"
    original = effect.read_text(encoding="utf-8")
    assert OLD in original
    cache = str(tmp_path / "cache")
    environment = {**os.environ, "PYTHONPATH": str(copy.parent), "BRISTLE_CACHE": cache}

    def run(line: str) -> dict[str, Any]:
        effect.write_text(original.replace(OLD, line), encoding="utf-8")
        done = subprocess.run(
            [sys.executable, str(program)], env=environment, capture_output=True, text=True,
            check=True,
        )  # fmt: skip
        told: dict[str, Any] = json.loads(done.stdout)
        assert Path(told["file"]).is_relative_to(copy)
        return told

    return run


def test_an_edited_effect_gives_its_new_force(edited: Any) -> None:
    first, again, other, back = (edited(line) for line in (OLD, OLD, NEW, OLD))
    assert first["force"] == pytest.approx(1.0 + 80.0 * 0.01)
    assert other["force"] == pytest.approx(1.0 + 3.0 * 80.0 * 0.01)
    assert again["force"] == back["force"] == first["force"]
    # The time loop carries every effect, so its folder changes with them.
    assert first["loop"] == again["loop"] == back["loop"] != other["loop"]
    # And what was compiled once is not compiled again.
    assert [told["hits"] for told in (first, again, other, back)] == [0, 1, 0, 1]


def test_the_same_code_in_another_module_has_machine_code_of_its_own() -> None:
    text = "def twice(x):\n    return 2.0 * x\n"
    found = []
    for name in ("of_one_folder.effect", "of_another.effect", "of_one_folder.effect"):
        module = ModuleType(name)
        exec(text, module.__dict__)
        found.append(digest(module.twice))
    assert found[0] == found[2] != found[1]


def twice(x: float, n: int) -> float:
    total = 0.0
    for k in range(n):
        if k % 2:
            total += x * k
        else:
            total -= x
    return total


def both(x: float, n: int) -> float:
    return twice(x, n) + twice(-x, n + 1) if x > 0.0 else twice(2.0 * x, n)


def test_callees_become_part_of_their_caller_as_numba_puts_them_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from numba.core import ir
    from numba.core.untyped_passes import InlineInlinables

    def text() -> str:
        found, name = jit.library_text(both, (1.0, 3), ("test_jit.twice",))
        return re.sub(r"\d+", "#", found.replace(name, "both"))

    ours = text()
    assert not hasattr(ir.Scope, "__deepcopy__")
    monkeypatch.setattr(jit, "_Inline", InlineInlinables)
    assert text() == ours
    assert "twice" not in "".join(line for line in ours.splitlines() if "call" in line)


def test_what_numba_imports_first_is_not_imported_beside_a_thread_that_compiles(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from numba.core.compiler_lock import global_compiler_lock

    done: list[int] = []
    context = SimpleNamespace(refresh=lambda: done.append(1))
    both = SimpleNamespace(typing_context=context, target_context=context)
    monkeypatch.setattr(jit, "cpu_target", both)
    thread = threading.Thread(target=jit._import_the_rest.__wrapped__)
    with global_compiler_lock:
        thread.start()
        thread.join(0.5)
        assert done == []
    thread.join(60.0)
    assert done == [1, 1]


NAMESAKES = """
import sys

import namesakes
from bristle.core.jit import compiled

LONG = "    x = math.sin(x) if x > 1.0 else x\\n" * 60  # too long to be inlined

found = []
for factor in sys.argv[1:]:
    exec(f"def inner(x):\\n{LONG}    return {factor} * x\\n", namesakes.__dict__)
    found.append(compiled(namesakes.outer)(1.0))
print(found)
"""


def test_machine_code_that_is_read_calls_its_own_functions_not_their_namesakes(
    tmp_path: Path,
) -> None:
    (tmp_path / "namesakes.py").write_text(
        "import math\n\n\ndef outer(x):\n    return inner(x) + 1.0\n"
    )
    paths = os.pathsep.join([str(tmp_path), str(PACKAGE.parent)])
    own = {**os.environ, "PYTHONPATH": paths, "BRISTLE_CACHE": str(tmp_path / "cache")}

    def told(*factors: str) -> str:
        order = [sys.executable, "-c", NAMESAKES, *factors]
        done = subprocess.run(order, env=own, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    assert told("2.0") == "[3.0]"  # each compiles in a process of its own, where numba counts anew
    assert told("5.0") == "[6.0]"
    assert told("2.0", "5.0") == "[3.0, 6.0]"  # both are read
