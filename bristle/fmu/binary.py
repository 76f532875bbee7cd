"""What makes up for two flaws of the binary that PythonFMU puts into an FMU.

At the end of a process: the binary keeps the state of the interpreter behind a static shared
pointer. The C library first runs that pointer's destructor, which frees the state; later the
binary's own `onLibraryUnload` resets the pointer once more, and so counts down a number in memory
that is free by then. Where malloc keeps this memory in one of its lists, the list is broken, and
whoever allocates or frees afterwards aborts the process: "corrupted double-linked list". The
libraries that were loaded after the FMU may do so, numba's for one. A pointer that has been reset
in time is left alone by both.

After an exception that leaves the FMU's Python code, Ctrl-C above all: the binary lets go of the
instance, its class and its messages, and once more when the instance is freed.

This module is bundled in every FMU: standard library only.
"""

from __future__ import annotations

import _thread
import atexit
import os
import sys
from collections.abc import Callable
from threading import RLock
from typing import Any

RESET = "finalizePythonInterpreter"
"""What the binary exports to reset its pointer."""

_registered: list[str] = []


def reset_at_exit() -> None:
    """Let `reset_binaries` run before the interpreter ends, whoever has loaded FMUs by then.

    In a host that is not Python a thread of the binary ends the interpreter, when the C library has
    begun to end the process: it is too late then, and nothing is done. On Windows the binary resets
    its pointer in time; for other systems PythonFMU has none.
    """
    if _registered or not sys.platform.startswith("linux"):
        return
    try:
        import ctypes
    except ImportError:  # a Python without libffi: it ends as it would without this module
        return
    _registered.append(RESET)
    atexit.register(_reset_in_time, ctypes)


def _reset_in_time(ctypes: Any) -> None:
    """Reset the pointers if this is the main thread of a Python host."""
    if _thread.get_native_id() == os.getpid():
        reset_binaries(ctypes)


def hold(*objects: object) -> None:
    """Add a reference to each object that nobody takes back: the one that the binary lets go of."""
    try:
        import ctypes
    except ImportError:
        return
    for one in objects:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(one))


def reset_binaries(ctypes: Any) -> int:
    """Reset the pointer of each of PythonFMU's binaries in this process; return how many there are.

    Instances that were not freed stay usable.

    Parameters
    ----------
    ctypes : the module; while an interpreter ends, none can be imported
    """
    count = 0
    for name in _loaded_libraries(ctypes):
        try:
            library = ctypes.PyDLL(name, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        except OSError:  # no file, as of what the kernel provides
            continue
        if hasattr(library, RESET):
            getattr(library, RESET)()
            count += 1
    return count


def _loaded_libraries(ctypes: Any) -> list[str]:
    """Return the names of the shared libraries in this process, as they were given to load them."""

    class Begin(ctypes.Structure):  # type: ignore[misc]
        """The begin of a dl_phdr_info."""

        _fields_ = (("address", ctypes.c_void_p), ("name", ctypes.c_char_p))

    names: list[str] = []

    def note(info: Any, _size: int, _data: Any) -> int:
        names.append(os.fsdecode(info.contents.name or b""))
        return 0

    visit = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(Begin), ctypes.c_size_t, ctypes.c_void_p)
    ctypes.PyDLL(None).dl_iterate_phdr(visit(note), None)
    return [name for name in names if name]


# Modules that FMUs in Python bring into this interpreter: threads come and go one at a time.
#
# An import takes its module out of `sys.modules` for a moment and fails if it is gone meanwhile. So
# who instantiates an FMU, or removes what one has left, holds the lock.

LOCK = RLock()


def forget(left: Callable[[str, object], bool]) -> None:
    """Remove modules from this interpreter, once no other thread imports any.

    Parameters
    ----------
    left : callable
        Name and module to whether it goes.
    """
    with LOCK:
        for name, module in list(sys.modules.items()):
            if left(name, module):
                sys.modules.pop(name, None)
