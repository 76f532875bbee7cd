"""What a user types after `import bristle`, whatever else was imported before or after."""

from __future__ import annotations

import subprocess
import sys

import pytest

import bristle


@pytest.mark.parametrize(
    "lines",
    [
        "import bristle",
        "import bristle; import bristle.simulate.run; import bristle.batch.execute",
        "import bristle.simulate.run; import bristle.batch.execute; import bristle",
        "import bristle; bristle.run; bristle.ensemble; import bristle.batch, bristle.simulate",
        "from bristle import ensemble, run; import bristle",
    ],
)
def test_public_names_are_functions_in_any_order_of_imports(lines: str) -> None:
    code = (
        f"{lines}\nfrom types import FunctionType\n"
        "assert type(bristle.run) is type(bristle.ensemble) is FunctionType\n"
        "print(bristle.run.__module__, bristle.ensemble.__module__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.stdout.split() == ["bristle.simulate.run", "bristle.batch.execute"], done.stderr


def test_public_names_are_listed() -> None:
    assert set(bristle.__all__) == {"__version__", "ensemble", "run"}
    assert set(bristle.__all__) <= set(dir(bristle))
    with pytest.raises(AttributeError, match="has no attribute 'runn'"):
        bristle.runn  # noqa: B018


def test_importing_the_package_is_light() -> None:
    code = "import sys, bristle; dir(bristle); print({'numpy', 'pandas', 'numba'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout == "set()\n", done.stderr
