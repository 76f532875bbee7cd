"""Runs a function in a process of its own, in which the project cannot be imported.

FMUs must work without it, and the modules of one FMU must not lean on what another has left. Each
process is a copy of one that has read fmpy and no FMU: to start Python anew takes twice as long.
"""

from __future__ import annotations

import atexit
import functools
import inspect
import json
import select
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).resolve().parent
LIMIT = 120
"""Seconds after which a process counts as hung."""

_BOOT = """
import json, os, sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name == "bristle" or name.startswith("bristle."):
            raise ModuleNotFoundError("the project is not here", name=name)

sys.meta_path.insert(0, Absent())
sys.path.append(sys.argv[1])
import live

for line in sys.stdin:
    os.chdir(line.rstrip("\\n"))
    if child := os.fork():
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
        continue
    said = os.open("said", os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    for stream in (1, 2):
        os.dup2(said, stream)
    job = json.load(open("job.json", encoding="utf-8"))
    namespace = {}
    exec(compile(job["source"], job["file"], "exec"), namespace)
    answer = namespace[job["name"]](*job["arguments"])
    try:
        import bristle
    except ModuleNotFoundError:
        pass
    else:
        sys.exit("the project could be imported after all")
    with open("answer.json", "w", encoding="utf-8") as file:
        json.dump(answer, file)
    break
"""


@functools.cache
def _mother() -> subprocess.Popen[str]:
    command = [sys.executable, "-I", "-c", _BOOT, str(HERE)]
    mother = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(mother.kill)
    return mother


def fresh(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function whose calls run in a process of their own, arguments and answer as JSON.

    The function travels as its source: it imports what it needs itself, `live` for one.
    """
    source = textwrap.dedent(inspect.getsource(function))
    source = "from __future__ import annotations\n" + source[source.index("def ") :]

    @functools.wraps(function)
    def call(*arguments: Any) -> Any:
        if sys.platform == "win32":
            pytest.skip("a process is copied on POSIX")
        mother = _mother()
        assert mother.stdin is not None
        assert mother.stdout is not None
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            job = {
                "source": source,
                "file": f"<{function.__name__}>",
                "name": function.__name__,
                "arguments": [str(a) if isinstance(a, Path) else a for a in arguments],
            }
            (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")
            print(folder, file=mother.stdin, flush=True)
            if not select.select([mother.stdout], [], [], LIMIT)[0]:
                mother.kill()
                _mother.cache_clear()
                pytest.fail(f"{function.__name__} hangs")
            status = int(mother.stdout.readline())
            assert status == 0, f"exit {status}\n{(folder / 'said').read_text()}"
            return json.loads((folder / "answer.json").read_text(encoding="utf-8"))

    return call
