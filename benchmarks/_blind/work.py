"""One part of one case, in whatever process: asked, and packed for the record."""

from __future__ import annotations

import time
import traceback
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

from . import record
from .plan import APART, Task

PARTS = ("diagnosis", "peers")


def digests() -> dict[str, str]:
    """Return the digest of the code that each part's answers rest on, the generator's included."""
    from . import cases, subject

    made = cases.generator_digest()
    own = cases.digest_of([cases.ROOT / "benchmarks" / "_blind" / "methods.py"])
    under_test = subject.digest()
    return {"diagnosis": f"{made}-{under_test}", "peers": f"{made}-{own}"}


def finished(path: Path, tasks: list[Task], part: str) -> list[dict[str, Any]]:
    """Return the lines of a record that the code of now has written for a part of these tasks."""
    done = record.finished(path, digests())[part]
    return [done[task.key] for task in tasks if task.key in done]


def parts_of(task: Task) -> tuple[str, ...]:
    """Return who is asked of a case: on buildings the package alone, for no peer takes one.

    Nor has any peer a term for an end stop, or one for what only a learned curve finds.
    """
    return ("diagnosis",) if task.kind in APART else PARTS


def do(part: str, task: Task, digest: str) -> dict[str, Any]:
    """Return one finished line: the answer of `part` on a case, its truth, the time it took.

    An error is an answer too; it is counted as a wrong one.
    """
    from . import cases

    line: dict[str, Any] = {
        "part": part, "key": task.key, "digest": digest, "task": asdict(task),
    }  # fmt: skip
    try:
        case = cases.load(task)
    except ValueError as error:  # the specimen's equations were not solved: no case
        return line | {"truth": None, "error": f"no case: {error}"}
    line["truth"] = slim(case.truth)
    before = time.perf_counter()
    try:
        line["answer"] = _answer(part, case)
    except Exception:  # whatever it is, it is the method's failure on this case
        line["error"] = traceback.format_exc()
    return line | {"seconds": time.perf_counter() - before}


def _answer(part: str, case: Any) -> dict[str, Any]:
    if part == "peers":
        from . import methods

        return methods.ask(case)
    from . import inseparable, subject

    if case.task.kind == "structure":
        from . import building

        return building.ask(case)
    answer, found = subject.ask(case)
    return answer | inseparable.follow_up(case, answer, found.experiment)


def slim(truth: dict[str, Any]) -> dict[str, Any]:
    """Return the part of a truth that scoring needs."""
    kept = (
        "base", "scales", "effects", "fault", "share", "share_holdout", "share_low_passed",
        "wanted",
    )  # fmt: skip
    return {name: truth[name] for name in kept}


def local(jobs: list[tuple[str, Task, str]], workers: int) -> Iterator[dict[str, Any]]:
    """Yield finished lines as they come, from processes of this machine."""
    if workers <= 1:
        yield from (do(*job) for job in jobs)
        return
    with ProcessPoolExecutor(workers) as pool:
        futures: list[Future[dict[str, Any]]] = [pool.submit(do, *job) for job in jobs]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
