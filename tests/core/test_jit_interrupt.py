"""Ctrl-C while numba is imported for the first time: it comes through once numba is whole."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import bristle

SCRIPT = """
import os
import signal
import sys

sys.path.insert(0, {package!r})
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it


class Press:
    '''Presses Ctrl-C as a certain module is about to be imported.'''

    pressed = False

    def find_spec(self, name, path=None, target=None):
        if name == {module!r} and not self.pressed:
            self.pressed = True
            os.kill(os.getpid(), signal.SIGINT)


press = Press()
sys.meta_path.insert(0, press)
import bristle

def twice(x):
    return 2.0 * x


try:
    from bristle.core.jit import compiled

    compiled(twice, keep=False)
except KeyboardInterrupt:
    print("interrupted", press.pressed)
from bristle.core.jit import compiled

print(compiled(twice, keep=False)(21.0))
"""
RUN = """
try:
    bristle.run("bench_sine_bingham", {"run.stop": 0.1}, engine="compiled")
except KeyboardInterrupt:
    print("interrupted", press.pressed)
print(len(bristle.run("bench_sine_bingham", {"run.stop": 0.1}, engine="compiled")))
"""
DURING = ["numba", "numba.core.types", "llvmlite.binding", "numba.np.arrayobj"]
"""Modules of which the last is imported as numba first compiles."""


def run(script: str, module: str) -> list[str]:
    package = str(Path(bristle.__file__).resolve().parent.parent)
    text = script.format(package=package, module=module)
    command = [sys.executable, "-c", text]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    "module",
    # A compiling process each: other moments of an interruption.
    [pytest.param(one, marks=pytest.mark.slow) if one in DURING[1:3] else one for one in DURING],
)
def test_numba_is_whole_behind_it(module: str) -> None:
    assert run(SCRIPT, module) == ["interrupted True", "42.0"]


@pytest.mark.slow  # the engine is compiled in a process, interrupted beside
@pytest.mark.parametrize("module", DURING)
def test_the_compiled_engine_runs_behind_it(module: str) -> None:
    head = SCRIPT.partition("def twice")[0]
    assert run(head + RUN.replace("{", "{{").replace("}", "}}"), module) == [
        "interrupted True", "201",
    ]  # fmt: skip
