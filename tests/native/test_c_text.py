"""C of compiled functions: the bits of what numba runs, and a word where there is no C."""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from bristle.core.jit import library_text
from bristle.errors import BuildError
from bristle.native import zig
from bristle.native.c_functions import CLine, c_text, needed
from bristle.native.entrance import NAME, plain_text
from bristle.native.zig import here

pytest.importorskip("ziglang")

NUMBERS = [0.0, -0.0, 1.5, -2.25, 1e300, -1e-310, math.inf, -math.inf, math.nan]
WHOLES = [0, 1, -1, 7, -7, 2**62, -(2**63)]


def compare(x: float, y: float) -> float:
    """Every comparison of reals, each with a digit of its own."""
    code = 0.0
    code += 1.0 if x < y else 0.0
    code += 2.0 if x <= y else 0.0
    code += 4.0 if x > y else 0.0
    code += 8.0 if x >= y else 0.0
    code += 16.0 if x == y else 0.0
    code += 32.0 if x != y else 0.0
    code += 64.0 if not x < y else 0.0
    code += 128.0 if math.isnan(x) or x == -y else 0.0
    return code


def compute(x: float, y: float) -> float:
    big = max(x, y) - min(abs(x), 3.0)
    return -big * 0.1 + math.copysign(x, y) - math.tanh(y) * math.exp(-abs(x))


def chosen(k: int, n: int) -> int:
    """Return what loops, tuples and whole numbers give, over their range too."""
    row = (3, -5)
    total = k * 3 - n
    for i in range(n & 3):
        total += row[i % 2] * (k // 3 if k > 0 else -k % 7)
        total ^= i << 2
    while total > 1000:
        total = total // 2 - 1
    return total


def in_c(function: Callable[..., Any], kind: Any, folder: Path) -> Callable[..., Any]:
    """Return a function of two arguments, compiled by numba, written as C, compiled by zig."""
    text = c_text(plain_text(*library_text(function, (kind(1).value, kind(1).value))))
    (folder / "one.c").write_text(text)
    call = "double" if kind is ctypes.c_double else "int64_t"
    (folder / "two.c").write_text(
        f"#include <stdint.h>\nint {NAME}({call} *, void **, {call}, {call});\n"
        f'__attribute__((visibility("default"))) {call} call({call} x, {call} y)\n'
        f"{{ {call} z; void *e; {NAME}(&z, &e, x, y); return z; }}\n"
    )
    library = folder / f"one{here().suffix}"
    zig.link([folder / "one.c", folder / "two.c"], folder, library, here())
    loaded = ctypes.CDLL(str(library)).call
    loaded.argtypes, loaded.restype = [kind, kind], kind
    return loaded


@pytest.mark.parametrize("function", [compare, compute], ids=lambda one: one.__name__)
def test_reals_give_the_bits_of_numba(function: Callable[..., float], tmp_path: Path) -> None:
    own, right = (
        in_c(function, ctypes.c_double, tmp_path),
        numba.njit(error_model="numpy")(function),
    )
    for x in NUMBERS:
        for y in NUMBERS:
            pair = (own(x, y), right(x, y))
            assert struct.pack("d", pair[0]) == struct.pack("d", pair[1]) or all(
                map(math.isnan, pair)
            ), (x, y)


def test_whole_numbers_give_those_of_numba(tmp_path: Path) -> None:
    own, right = in_c(chosen, ctypes.c_int64, tmp_path), numba.njit(error_model="numpy")(chosen)
    with np.errstate(over="ignore"):
        for k in WHOLES:
            for n in (0, 1, -3, 9, 2**40):
                assert own(k, n) == right(k, n), (k, n)


BEGIN = "define hidden i32 @bristle_entrance(ptr %retptr, double %x) {\nentry:\n"


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("%a = atomicrmw add ptr %retptr, i64 1 seq_cst", "atomicrmw"),
        ("%a = bitcast double %x to i64", "the bits of double as i64"),
        ("%a = call double @llvm.fshl.i64(double %x)", "llvm.fshl.i64 is not known"),
        ("%a = fadd <2 x double> %x, %x", "'<' is no type"),
        ("unreachable", "unreachable"),
    ],
)
def test_what_has_no_c_is_refused_with_its_line(line: str, why: str) -> None:
    with pytest.raises(BuildError, match="there is no C for") as caught:
        c_text(f"{BEGIN}  {line}\n  ret i32 0\n}}\n")
    assert line[:20] in str(caught.value)
    assert why in str(caught.value)


def test_numbers_keep_their_bits() -> None:
    lines = [
        "store double 0x3FB999999999999A, ptr %retptr",
        "store double 0x7FF0000000000000, ptr %retptr",
    ]
    text = c_text(BEGIN + "".join(f"  {line}\n" for line in lines) + "  ret i32 0\n}\n")
    assert "*(double *)retptr_ = 0.1;" in text
    assert "= INFINITY;" in text


def test_constants_are_kept_and_what_python_needs_is_not() -> None:
    text = c_text(
        '@.bytes.1 = internal constant [3 x i8] c"a\\C3\\00"\n'
        "@table = internal constant [2 x double] [double 1.0e+00, double -2.5e+00]\n"
        "@_ZN08NumbaEnv1f = internal global ptr null\n"
        f"{BEGIN}  %a = load double, ptr @table\n  store double %a, ptr %retptr\n"
        "  ret i32 0\n}\n"
    )
    assert "{97, -61, 0}" in text
    assert "{1.0, -2.5}" in text
    assert "*(double *)(void *)&table_" in text
    assert "NumbaEnv" not in text


def test_what_nothing_reads_is_left_out() -> None:
    lines = [CLine("a = 1;", "a"), CLine("b = a;", "b"), CLine("f(c);"), CLine("c = 2;", "c")]
    assert [one.text for one in needed(lines)] == ["f(c);", "c = 2;"]
