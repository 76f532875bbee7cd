"""The table: one row per figure, counted from finished lines, with its goal and its interval."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._rows import Row
from . import score
from .plan import APART, SITES
from .score import Count, Line, count

NOT_YET = "-"


@dataclass(frozen=True)
class Figure:
    """One row: what is measured, on how many, its interval, the goal and how near it is.

    `value` in per cent where there is an interval. `ratio` is 1 or less where the goal is reached,
    None without a goal or without cases.
    """

    name: str
    value: float | None
    counts: str
    interval: tuple[float, float] | None
    goal: str
    ratio: float | None
    group: str = "main"

    def row(self) -> Row:
        """Return the figure as one of all benchmarks, with its counts and its interval."""
        measured = NOT_YET
        if self.value is not None and self.interval is not None:
            low, high = self.interval
            measured = f"{self.value:.1f} % ({self.counts}; {low:.0f}-{high:.0f} %)"
        elif self.value is not None:
            measured = f"{self.value:.3g} ({self.counts})"
        name = self.name if self.group == "main" else f"{self.group}: {self.name}"
        return Row(name, measured, self.goal, self.ratio)


def share(
    name: str, found: Count, goal: float | None = None, group: str = "main", most: bool = False
) -> Figure:
    """Return a row for a proportion; `goal` in per cent, at least or at most."""
    low, high = found.interval
    value = 100.0 * found.share if found.of else None
    ratio = None
    if goal is not None and value is not None:
        ratio = _ratio(value, goal) if most else _ratio(goal, value)
    sign = "<=" if most else ">="
    text = "" if goal is None else ("0 seen" if most and goal == 0.0 else f"{sign} {goal:g} %")
    return Figure(
        name, value, f"{found.good}/{found.of}", (100.0 * low, 100.0 * high), text, ratio, group
    )


def _ratio(small: float, large: float) -> float:
    if small == 0.0:
        return 0.0
    return small / large if large > 0.0 else float("inf")


def number(
    name: str, value: float, of: int, goal: float | None = None, group: str = "main", unit: str = ""
) -> Figure:
    """Return a row for a number that should be at most `goal`."""
    known = bool(np.isfinite(value)) and of > 0
    text = "" if goal is None else f"<= {goal:g}{unit}"
    ratio = None if goal is None or not known else _ratio(value, goal)
    return Figure(name, value if known else None, f"n = {of}", None, text, ratio, group)


def of_kind(lines: Iterable[Line], kind: str, noise: float) -> list[Line]:
    """Return the lines of one kind and noise that a case was made for."""
    return [
        line
        for line in lines
        if line["truth"] is not None
        and line["task"]["kind"] == kind
        and abs(line["task"]["noise"] - noise) < 1e-9
    ]


def figures(lines: list[Line], times: dict[str, float] | None = None) -> list[Figure]:
    """Return the rows of the table at 1 % noise, then the same by parts, then at 3 %."""
    bench = [line for line in lines if line["task"]["kind"] not in APART]
    rows = main_rows(bench, 0.01, "main") + parameter_rows(bench, 0.01, "main")
    rows += time_rows(bench, times or {}) + shared_rows(lines)
    rows += structure_rows(lines) + part_rows(bench)
    if any(abs(line["task"]["noise"] - 0.03) < 1e-9 for line in bench):
        rows += main_rows(bench, 0.03, "3 % noise") + parameter_rows(bench, 0.03, "3 % noise")
    return rows + building_rows(lines)


def main_rows(lines: list[Line], noise: float, group: str) -> list[Figure]:
    """Return the rows about verdicts."""
    single, outside = of_kind(lines, "effect", noise), of_kind(lines, "outside", noise)
    strong, weak = binned(single, "15 %", "40 %"), binned(single, "5 %")
    seen = binned(outside, "15 %", "40 %")
    unknown = [line for line in seen if score.calls_unknown(line)]
    classes = [line for line in single if score.in_class(line) and "resolved" in score.answer(line)]
    tried = [line for line in classes if score.answer(line).get("separated")]
    pairs = of_kind(lines, "pair", noise)
    faults, clean = of_kind(lines, "fault", noise), of_kind(lines, "none", noise)
    placed = count(unknown, score.coordinate_right)
    rows = [
        ("single effect right, 15 and 40 %", count(strong, score.names_effect), 95.0, False),
        ("single effect right, 5 %", count(weak, score.names_effect), 85.0, False),
        ("named and nothing else, 15 and 40 %", count(strong, score.names_it_alone), 90.0, False),
        ("false alarms on none", count(clean, score.false_alarm), 0.0, True),
        ("outside effect unknown, 15 and 40 %", count(seen, score.calls_unknown), 90.0, False),
        ("its coordinate right, of those unknown", placed, 80.0, False),
        ("class becomes the effect by separate_by", count(tried, score.separated), 70.0, False),
        ("sensor fault reported, no effect named", count(faults, score.reports_fault), 90.0, False),
        ("library effect called unknown", count(single, score.calls_unknown), 3.0, True),
        ("pair: both named, nothing else", count(pairs, score.names_both), 60.0, False),
        ("pair: one at least, nothing wrong", count(pairs, score.names_one_at_least), 90.0, False),
    ]
    return [share(name, found, goal, group, most) for name, found, goal, most in rows]


def binned(lines: Iterable[Line], *names: str) -> list[Line]:
    """Return the lines whose share reached lies in one of these bins."""
    return [line for line in lines if score.bin_of(line) in names]


def parameter_rows(lines: list[Line], noise: float, group: str) -> list[Figure]:
    """Return the rows about errors after adding, the true model and intervals."""
    single = of_kind(lines, "effect", noise)
    right = [line for line in single if score.names_effect(line)]
    same = [score.answer(line)["z_after"] for line in right if score.task(line).same_form]
    other = [score.answer(line)["z_after"] for line in right if not score.task(line).same_form]
    known = [
        line
        for line in lines
        if line["truth"] is not None and abs(line["task"]["noise"] - noise) < 1e-9
    ]
    true = [z for z in (score.answer(line).get("z_true") for line in known) if z is not None]
    inside = Count(sum(0.9 <= z <= 1.1 for z in true), len(true))
    forms: tuple[tuple[str, list[float], tuple[float | None, ...]], ...] = (
        ("same", same, (1.05, 1.15)), ("other", other, (None, None)),
    )  # fmt: skip
    rows = [
        number(f"held-out z after adding, {form} form, {what}", score.quantile(found, share_of),
               len(found), goal, group)
        for form, found, goals in forms
        for what, share_of, goal in zip(("median", "95th percentile"), (0.5, 0.95), goals,
                                        strict=True)
    ]  # fmt: skip
    rows.append(share("z of the true model in 0.9 to 1.1", inside, 90.0, group))
    return rows + interval_rows([*single, *of_kind(lines, "none", noise)], group)


def interval_rows(lines: list[Line], group: str) -> list[Figure]:
    """Return how often intervals cover and how wide they are, same form only."""
    found = [row for line in lines for row in score.intervals(line)]
    strong = [
        row
        for line in binned(lines, "15 %", "40 %")
        for row in score.intervals(line)
        if "." in row[0]
    ]
    covered = Count(sum(covers for _, covers, _ in found), len(found))
    row = share("95 % intervals that cover, same form", covered, None, group)
    fair = None if row.value is None else max(_ratio(90.0, row.value), row.value / 99.0)
    wide = 100.0 * score.quantile((w for _, _, w in strong), 0.5)
    return [
        Figure(row.name, row.value, row.counts, row.interval, "90-99 %", fair, group),
        number("median width of the effect's intervals, 15 and 40 %, per cent of the value", wide,
               len(strong), 30.0, group),
    ]  # fmt: skip


def time_rows(lines: list[Line], times: dict[str, float]) -> list[Figure]:
    """Return the times in fresh processes, compile included, and those inside a warm one."""
    warm = [score.answer(line)["seconds"] for line in lines if score.answer(line).get("seconds")]
    rows = []
    for name, goal in (("identification", 5.0), ("diagnosis", 30.0)):
        for how in ("nothing compiled yet", "compiled before"):
            key = f"one {name}, fresh process, {how}"
            value = times.get(key, float("nan"))
            rows.append(number(f"{key}, s", value, int(key in times), goal, "main"))
    name = "one diagnosis inside a warm process, median, s"
    return [*rows, number(name, score.quantile(warm, 0.5), len(warm))]


def shared_rows(lines: list[Line]) -> list[Figure]:
    """Return a row for each effect that a damper on a bench shares with an isolation layer."""
    strong = binned(of_kind(lines, "shared", 0.01), "15 %", "40 %")
    return [
        share(
            f"{name.replace('_', ' ')} on the bench right, 15 and 40 %",
            count([x for x in strong if x["task"]["effect"] == name], score.names_effect), 95.0,
        )
        for name in dict.fromkeys(line["task"]["effect"] for line in strong)
    ]  # fmt: skip


def structure_rows(lines: list[Line]) -> list[Figure]:
    """Return the rows of the building rig."""
    rows = []
    for force, late, goal in (("measured", False, 90.0), ("reconstructed", True, None)):
        found = on_building(lines, late)
        strong = binned([x for x in found if score.hidden(x)], "15 %", "40 %")
        alarms = count([x for x in found if not score.hidden(x)], score.false_alarm)
        name = f"structure rig, force {force}"
        rows += [
            share(f"{name}: right, 15 and 40 %", count(strong, score.names_in_building), goal),
            share(f"{name}: false alarms on none", alarms, 0.0, most=True),
        ]
    return rows


def on_building(lines: Iterable[Line], reconstructed: bool) -> list[Line]:
    """Return the lines of buildings whose damper's force was measured or reconstructed."""
    return [
        line
        for line in of_kind(lines, "structure", 0.01)
        if bool(line["task"].get("reconstructed")) == reconstructed
    ]


def building_rows(lines: list[Line]) -> list[Figure]:
    """Return the parts of the building's rows, what was set aside, and how long it took."""
    group, rows = "buildings", []
    for late, force in ((False, "measured"), (True, "reconstructed")):
        found = on_building(lines, late)
        hidden = [line for line in found if score.hidden(line)]
        strong = binned(hidden, "15 %", "40 %")
        weak = count(hidden, lambda x: score.bin_of(x) not in ("15 %", "40 %"))
        unknown = count(strong, score.calls_unknown)
        rows += [
            share(f"force {force}: below 15 %, set aside", weak, group=group),
            share(f"force {force}: called unknown", unknown, group=group),
        ]
        if late:
            twin = count(strong, score.tells_twin)
            rows.append(share("force reconstructed: only a twin is named", twin, group=group))
        for place, own in (("structure", True), ("damper", False)):
            part = [x for x in strong if (x["task"]["effect"] in SITES) == own]
            right = count(part, score.names_in_building)
            rows.append(share(f"force {force}: right, effects of the {place}", right, group=group))
    every = [line for line in lines if line["task"]["kind"] == "structure"]
    if not every:
        return []
    took = [score.answer(line)["cpu"] for line in every if score.answer(line).get("cpu")]
    broken = count(every, lambda x: "error" in x)
    return [
        *rows, share("errors", broken, group=group),
        number("one diagnosis, processor, median, s", score.quantile(took, 0.5), len(took),
               group=group),
        number("one diagnosis, processor, longest, s", score.quantile(took, 1.0), len(took),
               group=group),
    ]  # fmt: skip


def part_rows(lines: list[Line]) -> list[Figure]:
    """Return the parts of the main rows: bins, laws, rigs, forms, effects; what was set aside."""
    single, outside = of_kind(lines, "effect", 0.01), of_kind(lines, "outside", 0.01)
    faults, clean = of_kind(lines, "fault", 0.01), of_kind(lines, "none", 0.01)
    both = [*single, *outside]
    rows = [
        ("share reached below 2.5 %, set aside", count(both, lambda x: not score.bin_of(x))),
        ("strength not reachable within physical bounds", count(both, score.unreachable)),
        ("errors", count(lines, lambda x: "error" in x)),
    ]
    splits: list[tuple[str, Callable[[Line], Any]]] = [
        ("bin", score.bin_of),
        ("law", lambda x: x["task"]["law"]),
        ("rig", lambda x: x["task"]["rig"]),
        ("form", lambda x: "same" if score.task(x).same_form else "other"),
        ("effect", lambda x: x["task"]["effect"]),
    ]
    counted = [line for line in single if score.bin_of(line)]
    for what, of in splits:
        for value in sorted({str(of(line)) for line in counted}):
            group = [line for line in counted if str(of(line)) == value]
            rows.append((f"right, {what} {value}", count(group, score.names_effect)))
            if what in ("form", "bin"):
                rows.append((f"unknown, {what} {value}", count(group, score.calls_unknown)))
    for name, own in by_effect(outside).items():
        unknown = count([line for line in own if score.bin_of(line)], score.calls_unknown)
        rows.append((f"unknown, outside effect {name}", unknown))
    for name, own in by_effect(faults).items():
        rows.append((f"reported, {name}", count(own, score.reports_fault)))
    for name, own in {"none": clean, **by_effect(counted)}.items():
        found = [covers for line in own for _, covers, _ in score.intervals(line)]
        rows.append((f"intervals cover, effect {name}", Count(sum(found), len(found))))
    classes = [line for line in counted if score.answer(line)["kind"] == "ambiguous"]
    with_it = [line for line in classes if score.in_class(line)]
    rows += [
        ("15 and 40 %, right or in any class of at most three",
         count(binned(single, "15 %", "40 %"), score.names_effect_or_class)),
        ("verdict is a class, single effects", Count(len(classes), len(counted))),
        ("of these with the effect in it, inseparable by the separate test",
         count(with_it, score.inseparable)),
    ]  # fmt: skip
    return [share(name, found, group="parts") for name, found in rows]


def by_effect(lines: list[Line]) -> dict[str, list[Line]]:
    """Return lines by the effect that is hidden, in the order of the names."""
    names = sorted({line["task"]["effect"] for line in lines})
    return {name: [line for line in lines if line["task"]["effect"] == name] for name in names}
