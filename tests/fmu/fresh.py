"""Runs a function in a Python of its own, in which the project cannot be imported.

FMUs must work without it, and the modules of one FMU must not lean on what another has left.
"""

from __future__ import annotations

import functools
import inspect
import json
import os
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

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
job = json.load(open(sys.argv[1], encoding="utf-8"))
sys.path.append(job["folder"])
namespace = {}
exec(compile(job["source"], job["file"], "exec"), namespace)
answer = namespace[job["name"]](*job["arguments"])
try:
    import bristle
except ModuleNotFoundError:
    pass
else:
    sys.exit("the project could be imported after all")
with open(sys.argv[2], "w", encoding="utf-8") as file:
    json.dump(answer, file)
"""


def fresh(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function whose calls run in a process of their own, arguments and answer as JSON.

    The function travels as its source: it imports what it needs itself, `live` for one.
    """
    source = textwrap.dedent(inspect.getsource(function))
    source = "from __future__ import annotations\n" + source[source.index("def ") :]

    @functools.wraps(function)
    def call(*arguments: Any, **environment: str) -> Any:
        with tempfile.TemporaryDirectory() as folder:
            job, answer = Path(folder, "job.json"), Path(folder, "answer.json")
            job.write_text(
                json.dumps(
                    {
                        "folder": str(HERE),
                        "source": source,
                        "file": f"<{function.__name__}>",
                        "name": function.__name__,
                        "arguments": [str(a) if isinstance(a, Path) else a for a in arguments],
                    }
                ),
                encoding="utf-8",
            )
            command = [sys.executable, "-I", "-c", _BOOT, str(job), str(answer)]
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                cwd=folder,
                timeout=LIMIT,
                env={**os.environ, **environment},
            )
            assert done.returncode == 0, f"exit {done.returncode}\n{done.stdout}\n{done.stderr}"
            return json.loads(answer.read_text(encoding="utf-8"))

    return call
