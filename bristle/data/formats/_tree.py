"""Named arrays in structures, as MAT and HDF5 files hold them, as one table.

A node is a structure (dict), a list (an array of structures, a cell array), a text, or a `Leaf` of
numbers. What tells the time of a signal stands beside it: a vector that is called a time, the first
column of its own matrix, a sampling step or rate.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...core.text import listed
from ...errors import RecordError
from ...units import parse as parse_unit
from ..channels import quantity_of_unit
from ..noise import SHORTEST
from ..table import Table, from_arrays, one_below_the_other
from ..titles import title, unit_or_none
from ._one_time import Series, by_length, on_one_time, step_in

AnyArray: TypeAlias = NDArray[Any]

STARTS = ("t0", "x0", "tstart", "t_start", "starttime", "start_time")
"""Names, in small letters, of numbers beside a channel that tell when it begins."""
_TIMES = ("t", "time", "tout", "zeit")
_NAMES = ("name", "label", "signalname", "channelname")
_VALUES = ("data", "values", "value", "samples", "signal", "y")
_UNITS = ("unit", "units", "yunit", "y_unit")
_TELLS_NAMES = re.compile(r"name|label|header|hdr|channel|column|title|signal", re.IGNORECASE)
_TELLS_UNITS = re.compile(r"unit|einheit", re.IGNORECASE)
TELLS_SCALE = re.compile(r"scal(?:e|ing)|factor|sensitivity|lsb", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Leaf:
    """Numbers of any shape, with their unit and, of its time, what the file states."""

    array: AnyArray
    unit: str = ""
    about: Mapping[str, float] = field(default_factory=dict)


class Bare(dict[str, Any]):
    """A structure whose fields need no name of its own before theirs, unless two are alike."""


@dataclass(frozen=True)
class Unread:
    """An object of MATLAB that is not read, by its class."""

    what: str


Node: TypeAlias = "dict[str, Any] | list[Any] | str | Leaf | Unread"


@dataclass
class Found:
    """What a part of a file holds.

    `clocks` are (name of the time, time (n,) in its unit, channels (n,)); `loose` channels of no
    known time; `scalars` single numbers; `units` those that are stated.
    """

    clocks: list[tuple[str, AnyArray, dict[str, AnyArray]]] = field(default_factory=list)
    loose: dict[str, AnyArray] = field(default_factory=dict)
    scalars: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def free(self, *names: str) -> str:
        """Return the first name that no channel has, the last one with a number if all are taken.

        Parameters
        ----------
        names : the short one first
        """
        taken = {*self.loose, *(key for _, _, data in self.clocks for key in data)}
        taken |= {called for called, _, _ in self.clocks}
        for name in names:
            if name not in taken:
                return name
        return next(name for k in count(2) if (name := f"{names[-1]} ({k})") not in taken)

    def named(self, unit: str, *names: str) -> str:
        """Return such a name, and keep the unit of the channel, where the text is one."""
        name, known = self.free(*names), unit_or_none(unit)
        if known is not None:
            self.units[name] = known.name
        return name


def table_of(tree: Mapping[str, Node], name: str) -> Table:
    """Return the table of all that a file holds, on one time.

    Parameters
    ----------
    tree : its variables, or its groups and datasets
    name : the file, for messages

    Raises
    ------
    RecordError
        If there is no vector of numbers, or channels do not overlap in time.
    """
    found = Found()
    runs = next(_runs(tree), None)
    if runs is None:
        _scope(found, "", tree)
        return one_table(found, name)
    _scope(found, "", {key: one for key, one in tree.items() if key not in runs.within})
    return _run_by_run(found, runs, tree, name)


@dataclass(frozen=True)
class _Runs:
    """Runs by name; `called` is that of their array, `within` the variables that hold them."""

    called: str
    nodes: dict[str, Node]
    within: frozenset[str]


def _runs(tree: Mapping[str, Node]) -> Iterator[_Runs]:
    """Yield runs that a file holds beside each other.

    They are an array of structures with several channels each, or structures whose names differ by
    a number.
    """
    for key, node in tree.items():
        if isinstance(node, list) and len(node) > 1 and _is_runs(node):
            nodes = {f"{key}({number})": one for number, one in enumerate(node, 1)}
            yield _Runs(key, nodes, frozenset({key}))
        elif isinstance(node, dict) and not (_is_signal(node) or _is_recorder(node)):
            yield from (_Runs(one.called, one.nodes, frozenset({key})) for one in _runs(node))
    stems: dict[str, dict[str, Node]] = {}
    for key, node in tree.items():
        if isinstance(node, dict) and re.search(r"\d", key):
            stems.setdefault(re.sub(r"\d+", "", key), {})[key] = node
    for stem, nodes in stems.items():
        if len(nodes) > 1 and _is_runs(list(nodes.values())):
            yield _Runs(stem, nodes, frozenset(nodes))


def _is_recorder(node: Mapping[str, Any]) -> bool:
    """Return whether a structure holds signals as Simulink or dSPACE write them."""
    return isinstance(_get(node, ("signals",)), dict | list) or _named_all(node)


def _is_runs(nodes: list[Node]) -> bool:
    """Return whether nodes are alike, and each holds a time or several channels of a run."""
    if all(isinstance(one, Leaf) and one.array.ndim == 2 for one in nodes):
        shapes = {min(one.array.shape) for one in nodes if isinstance(one, Leaf)}
        return len(shapes) == 1 and min(shapes) > 2
    if not all(isinstance(one, dict) and not _is_signal(one) for one in nodes):
        return False
    found = []
    for one in nodes:
        assert isinstance(one, dict)
        inside = Found()
        _scope(inside, "", one)
        found.append({*inside.loose, *(k for _, _, data in inside.clocks for k in data)})
    return len(found[0]) > 1 and all(len(found[0] & other) > 1 for other in found[1:])


def _is_signal(node: Node) -> bool:
    """Return whether a structure is one signal: its name and values, or its time and values."""
    if not isinstance(node, dict):
        return False
    signals = _get(node, ("signals",))
    if signals is not None or _named_all(node):
        return isinstance(signals, dict)
    known = {key.lower() for key in node}
    if known & {*_NAMES} and known & {*_VALUES}:
        return True
    vectors = [key for key, one in node.items() if _vector(one) is not None]
    return len(vectors) == 2 and sum(_is_time_name(key) for key in vectors) == 1


def _run_by_run(beside: Found, runs: _Runs, tree: Mapping[str, Node], name: str) -> Table:
    """Return the table of several runs, one below the other, with a column of their numbers.

    Parameters
    ----------
    beside : what the file holds beside the runs, of which the step counts for all
    runs, tree : the runs, and all that the file holds
    name : the file, for messages
    """
    texts = {key: one for key, one in tree.items() if _texts(one)}
    tables = []
    for called, node in runs.nodes.items():
        inside = Found(scalars=dict(beside.scalars))
        _scope(inside, "", node if isinstance(node, dict) else {**texts, runs.called: node})
        tables.append(one_table(inside, f"{name}, {called}"))
    joined = one_below_the_other(tables, name, "run")
    lost = {one.text for table in tables for one in table.columns} - set(joined.values)
    title = joined.split.removeprefix("column ")
    remarks = [
        f"it holds {len(runs.nodes)} runs ({listed(runs.nodes, 4)}), here one below the other: "
        f'"{title}" tells them apart',
        *joined.remarks,
    ]
    if lost:
        remarks.append(f"not in all runs, and left out: {listed(sorted(lost))}")
    if others := [*beside.loose, *(key for _, _, data in beside.clocks for key in data)]:
        remarks.append(f"beside the runs, and left out: {listed(others)}")
    return replace(joined, remarks=tuple(remarks))


def one_table(found: Found, name: str) -> Table:
    """Return the table of one run."""
    found.clocks += [] if found.clocks else _by_steps(found)
    clocks = _merged(found)
    if not clocks:
        return _without_time(found, name)
    remarks = list(found.remarks)
    units: dict[str, str | None] = dict(found.units)
    series = [Series(_in_seconds(key, time, units), data) for key, time, data in clocks]
    series, loose = by_length(found.loose, series)
    kept = [(clock, one) for clock, one in zip(clocks, series, strict=True) if one.data]
    if not kept:
        kept = [(clocks[0], series[0])]
    if len(kept) == 1:
        (key, raw, _), one = kept[0]
        data, rows = {key: raw, **one.data}, len(raw)
    else:
        joined = on_one_time([one for _, one in kept], name)
        called = next(text for text in ("time", "time of all") if text not in joined.data)
        data, rows = {called: joined.time, **joined.data}, len(joined.time)
        units[called] = "s"
        remarks = [*joined.remarks, *remarks]
    if loose:
        remarks.append(
            f"left out, for they have another length than {rows}: {listed(sorted(loose))}"
        )
    return from_arrays(data, name, units, tuple(found.notes), tuple(remarks))


def _merged(found: Found) -> list[tuple[str, AnyArray, dict[str, AnyArray]]]:
    """Return the clocks, those of equal times as one."""
    out: list[tuple[str, AnyArray, dict[str, AnyArray]]] = []
    for key, time, data in found.clocks:
        same = next((one for one in out if _equal(one[1], time)), None)
        if same is None:
            out.append((key, time, dict(data)))
        else:
            same[2].update(data)
    return out


def _equal(a: AnyArray, b: AnyArray) -> bool:
    if len(a) != len(b):
        return False
    step = float(np.median(np.diff(a)))
    return bool(np.max(np.abs(a - b)) < 0.02 * step)


def _in_seconds(key: str, time: AnyArray, units: Mapping[str, str | None]) -> AnyArray:
    """Return a time in s, by the unit that is stated or in its name; s where there is none."""
    stated = units.get(key)
    unit = parse_unit(stated) if stated else title(0, key).unit
    factor = unit.factor if unit and quantity_of_unit(unit.name) == "time" else 1.0
    return np.asarray(time, dtype=float) * factor


def _by_steps(found: Found) -> list[tuple[str, AnyArray, dict[str, AnyArray]]]:
    """Return clocks by the steps and starts that stand beside channels, [] where all are alike."""
    starts: dict[str, float] = {}
    steps: dict[str, float] = {}
    for key, value in found.scalars.items():
        place, short = key.rpartition(".")[0], _short(key)
        if short in STARTS and np.isfinite(value):
            starts[place] = value
        elif step := step_in(key, value):
            steps.setdefault(place, step)
    if len({(starts.get(place, 0.0), step) for place, step in steps.items()}) < 2:
        return []
    clocks: dict[Any, tuple[str, AnyArray, dict[str, AnyArray]]] = {}
    for key, array in found.loose.items():
        own = [place for place in steps if key == place or key.startswith(f"{place}.")]
        if not own and "" not in steps:
            continue
        place = max(own, key=len, default="")
        clock = (starts.get(place, 0.0), steps[place], len(array))
        time = clock[0] + clock[1] * np.arange(len(array))
        called = f"{place}.time" if place else "time"
        clocks.setdefault(clock, (called, time, {}))[2][key] = array
    for _, _, data in clocks.values():
        for key in data:
            del found.loose[key]
    return list(clocks.values())


def _without_time(found: Found, name: str) -> Table:
    """Return the table of the vectors of the commonest length; a step or a rate gives the time."""
    lengths = Counter(map(len, found.loose.values()))
    if not lengths:
        what = "".join(f" {remark[:1].upper()}{remark[1:]}." for remark in found.remarks)
        raise RecordError(f"{name}: the file holds no vector of numbers.{what}")
    size = max(lengths, key=lambda length: (lengths[length], length))
    data = {key: array for key, array in found.loose.items() if len(array) == size}
    others = sorted(set(found.loose) - set(data))
    remarks = list(found.remarks)
    if others:
        remarks.insert(0, f"left out, for they have another length than {size}: {listed(others)}")
    notes = list(found.notes)
    timed = any(_is_time_name(key) for key in data)
    for key, value in found.scalars.items():
        if not timed and (step := step_in(key, value)):
            data["time_s"] = np.arange(size) * step
            notes.append(f"the time is made from {key} = {value:g}: {step:g} s a sample")
            break
    return from_arrays(data, name, dict(found.units), tuple(notes), tuple(remarks))


def _scope(found: Found, key: str, fields: Mapping[str, Node]) -> None:
    """Add what a structure holds.

    Parameters
    ----------
    found : that to which it is added
    key : name of the structure, "" for the whole file
    fields : its content
    """
    before = key + "." if key and not isinstance(fields, Bare) else ""
    names = {one: str(_get(_header(fields, one), _NAMES) or one) for one in fields}
    paths = {one: before + name for one, name in names.items()}
    long = {one: f"{key}.{name}" if key else name for one, name in names.items()}
    vectors = {one: array for one, node in fields.items() if (array := _vector(node)) is not None}
    for one, node in fields.items():
        if (value := _scalar(node)) is not None:
            found.scalars[long[one]] = value
        elif isinstance(node, Leaf):
            found.scalars |= {f"{long[one]}.{name}": v for name, v in node.about.items()}
        elif isinstance(node, Unread):
            found.remarks.append(
                f"{long[one]} is a {node.what} object of MATLAB, which is not read: save its "
                "vectors, as in x = ts.Data"
            )
    _note_counts(found, fields, long)
    own: dict[int, dict[str, AnyArray]] = {}
    added = []
    paired: set[str] = set()
    for one, array in vectors.items():
        # Each signal may have its time beside it: Data1_time_force and Data1_force.
        signal = re.sub("_?time", "", one, flags=re.IGNORECASE) if _is_time_name(one) else one
        if signal != one and _rises(array) and len(vectors.get(signal, ())) == len(array):
            its = found.named(_unit_beside(fields, signal), paths[signal], long[signal])
            found.clocks.append((found.free(paths[one], long[one]), array, {its: vectors[signal]}))
            paired |= {one, signal}
    for one, array in vectors.items():
        if one in paired:
            continue
        alone = [key] if key and len(vectors) == 1 and one.lower() in _VALUES else []
        called = found.named(_unit_beside(fields, one), *alone, paths[one], long[one])
        if _is_time_name(names[one]) and len(array) not in own and _rises(array):
            own[len(array)] = {}
            found.clocks.append((called, array, own[len(array)]))
        else:
            found.loose[called] = array
            added.append(called)
    for name in added:
        if (beside := own.get(len(found.loose[name]))) is not None:
            beside[name] = found.loose.pop(name)
    timed = bool(own) or any(step_in(one, value) for one, value in found.scalars.items())
    for one, node in fields.items():
        if isinstance(node, Leaf) and one not in vectors and node.array.size > 1:
            _matrix(found, long[one], paths[one], node, fields, timed)
        elif isinstance(node, dict):
            _structure(found, long[one], node)
        elif isinstance(node, list) and not _texts(node):
            _list(found, long[one], node)


def _note_counts(found: Found, fields: Mapping[str, Node], names: Mapping[str, str]) -> None:
    """Note whole numbers beside which a scale stands: nothing tells that they are its counts."""
    leaves = {key: node for key, node in fields.items() if isinstance(node, Leaf)}
    scales = [key for key in leaves if TELLS_SCALE.search(key)]
    for key, leaf in leaves.items():
        beside = [*filter(TELLS_SCALE.search, leaf.about), *scales]
        whole = leaf.array.dtype.kind in "iu" and leaf.array.size > 1
        if whole and beside and key not in scales and not _is_time_name(key):
            found.remarks.append(
                f"{names[key]} holds {leaf.array.dtype}, and {listed(beside)} beside it is not "
                f"applied: expected values in a unit, such as {names[key]} * {beside[0]}"
            )


def _structure(found: Found, key: str, node: dict[str, Any]) -> None:
    """Add a structure: signals of Simulink, of dSPACE, one signal, or any other."""
    signals = _get(node, ("signals",))
    if isinstance(signals, dict | list) and _add_simulink(found, key, node, signals):
        return
    if _named_all(node):
        _add_dspace(found, key, node)
    elif _is_signal(node):
        _add_signal(found, key, node)
    else:
        _scope(found, key, node)


def _list(found: Found, key: str, nodes: list[Any]) -> None:
    """Add the items of an array of structures or of a cell array, called `key(1)`, `key(2)` ..."""
    for number, one in enumerate(nodes, 1):
        called = f"{key}({number})" if len(nodes) > 1 else key
        if isinstance(one, dict):
            _structure(found, called, one)
        elif isinstance(one, list) and not _texts(one):
            _list(found, called, one)
        elif isinstance(one, Leaf) and one.array.size > 1:
            _scope(found, "", {called: one})


def _add_simulink(found: Found, key: str, node: dict[str, Any], signals: Any) -> bool:
    """Add signals of Simulink, structure with time or without, by their labels."""
    every = [one for one in (signals if isinstance(signals, list) else [signals]) if one]
    if not all(isinstance(one, dict) and isinstance(one.get("values"), Leaf) for one in every):
        return False
    data: dict[str, AnyArray] = {}
    for number, one in enumerate(every, 1):
        names = next((own for of in ("label", "title") if any(own := _texts(one.get(of)))), [])
        place = f"{key}.signals({number}).values" if len(every) > 1 else key
        columns = list(_columns(one["values"].array))
        if len(names) == 1 < len(columns):  # of a bus: "<force [N]>, <x [mm]>"
            parts = [text.strip(" <>") for text in names[0].split(",")]
            names = parts if len(parts) == len(columns) else names
        if len(names) != len(columns) or not all(names):
            base = names[0] if len(names) == 1 and names[0] else place
            several = len(columns) > 1
            names = [f"{base}_{k}" if several else base for k in range(1, len(columns) + 1)]
        for text, column in zip(names, columns, strict=True):
            # Names are free of those that are there and of those of this structure.
            called = text if text not in data else f"{place}.{text}"
            data[found.free(called, f"{place}.{text}")] = column
    time = _vector(_get(node, ("time",)))
    if time is not None and _rises(time):
        alike = {name: data.pop(name) for name, one in [*data.items()] if len(one) == len(time)}
        found.clocks.append((found.named("s", f"{key}.time"), time, alike))
    found.loose |= data
    return True


def _named_all(node: Mapping[str, Any]) -> bool:
    """Return whether X and Y of a structure hold signals with a name each, as dSPACE writes."""
    x, y = _get(node, ("x",)), _get(node, ("y",))
    items = [*(x if isinstance(x, list) else [x]), *(y if isinstance(y, list) else [y])]
    return all(isinstance(one, dict) and _name_and_data(one) is not None for one in items)


def _name_and_data(node: Mapping[str, Any]) -> tuple[str, AnyArray, str] | None:
    """Return name, vector and unit of a signal, None where it has no name or no vector."""
    text, array = _get(node, _NAMES), _vector(_get(node, _VALUES))
    if not isinstance(text, str) or not text.strip() or array is None:
        return None
    return text.replace('"', "").strip(), array, _unit_of(node)


def _add_dspace(found: Found, key: str, node: Mapping[str, Any]) -> None:
    """Add signals Y at the times X that their XIndex names."""
    xs, ys = (
        one if isinstance(one, list) else [one] for one in (_get(node, ("x",)), _get(node, ("y",)))
    )
    clocks: list[dict[str, AnyArray] | None] = []
    for number, x in enumerate(xs, 1):
        text, array, unit = _name_and_data(x)  # type: ignore[misc]  # see _named_all
        place = f"{key}.X.{text}" if len(xs) == 1 else f"{key}.X({number}).{text}"
        called = found.named(unit or "s", place)
        clocks.append({} if _rises(array) else None)
        if (own := clocks[-1]) is not None:
            found.clocks.append((called, array, own))
        else:
            found.loose[called] = array
    for number, y in enumerate(ys, 1):
        text, array, unit = _name_and_data(y)  # type: ignore[misc]  # see _named_all
        called = found.named(unit, text, f"{key}.Y({number}).{text}")
        index = _get(y, ("xindex",))
        at = int(index.array.ravel()[0]) - 1 if isinstance(index, Leaf) and index.array.size else 0
        clock = clocks[at] if 0 <= at < len(clocks) else None
        sizes = [len(time) for _, time, data in found.clocks if data is clock]
        if clock is not None and sizes == [len(array)]:
            clock[called] = array
        else:
            found.loose[called] = array


def _add_signal(found: Found, key: str, node: Mapping[str, Any]) -> None:
    """Add one signal with its name, or with its own time."""
    named = _name_and_data(node)
    vectors = {one: array for one, v in node.items() if (array := _vector(v)) is not None}
    found.scalars |= {
        f"{key}.{one}": v for one, leaf in node.items() if (v := _scalar(leaf)) is not None
    }
    timed = next((one for one in vectors if _is_time_name(one)), "Time")
    if named is not None:
        text, array, unit = named
        names = [f"{key}.{text}"]
    else:
        value = next((one for one in vectors if one != timed), None)
        if value is None:
            _scope(found, key, node)
            return
        array, unit = vectors[value], _unit_of(node) or node[value].unit
        short = value if isinstance(node, Bare) else f"{key}.{value}"
        names = [key if value.lower() in _VALUES else short, f"{key}.{value}"]
    called = found.named(unit, *names)
    info = one if isinstance(one := _get(node, ("timeinfo",)), dict) else {}
    start, step = (_scalar(info.get(one)) for one in ("Start", "Increment"))
    time = vectors.get(timed)
    if time is None and step:  # a time series of even steps
        time = (start or 0.0) + step * np.arange(len(array))
    if time is not None and len(time) == len(array):
        there = np.isfinite(time)
        if _rises(time[there]):
            clock = found.named(_unit_of(info), f"{key}.{timed}")
            found.clocks.append((clock, time[there], {called: array[there]}))
            return
        found.remarks.append(
            f"{key}.{timed} does not increase from sample to sample: {called} is taken at the times"
            " of the others"
        )
    found.loose[called] = array


def _matrix(
    found: Found, key: str, short: str, node: Leaf, fields: Mapping[str, Node], timed: bool
) -> None:
    """Add the columns of a matrix, by the names and units that stand beside it.

    Without them they are called `key_1`, `key_2`. Where nothing else tells the time, a first column
    that rises throughout is the time of the others.
    """
    if node.array.dtype.kind not in "fiub" or node.array.ndim > 2:
        what = f"{node.array.ndim} dimensions" if node.array.ndim > 2 else f"{node.array.dtype}"
        found.remarks.append(f"{key} is not read: it holds {what}, and no columns of numbers")
        return
    columns = list(_columns(node.array))
    first_rises = _rises(columns[0]) and not timed and not all(map(_rises, columns))
    names, units = (
        _for_columns(found, key, fields, tells, len(columns), first_rises)
        for tells in (_TELLS_NAMES, _TELLS_UNITS)
    )
    pair = len(columns) == 2 and first_rises and not names
    texts = names or [f"{short}_{k}" for k in range(1, len(columns) + 1)]
    if pair:
        texts = [f"{short}.time", short]
    called = []
    for k, text in enumerate(texts):
        name = found.free(text, f"{key}.{text}")
        while name in called:
            name = f"{name} ({k + 1})"
        called.append(name)
        if (unit := unit_or_none(units[k] if units else node.unit)) is not None:
            found.units[name] = unit.name
    data = dict(zip(called, columns, strict=True))
    by_name = next((name for name in called if _is_time_name(name) and _rises(data[name])), None)
    time = by_name or (called[0] if first_rises else None)
    if time is None or timed:
        found.loose |= data
    else:
        found.clocks.append((time, data.pop(time), data))


def _for_columns(
    found: Found, key: str, fields: Mapping[str, Node], tells: re.Pattern[str], count: int,
    first_rises: bool,
) -> list[str]:  # fmt: skip
    """Return the texts beside a matrix that are one for each of its columns, [] if there are none.

    One less than columns are those of the others, where the first is a time.
    """
    beside = [*fields.items()]
    beside += [pair for node in fields.values() if isinstance(node, dict) for pair in node.items()]
    for one, node in beside:
        texts = _texts(node) if tells.search(one) else []
        if len(texts) == 1:
            texts = [text.strip() for text in re.split(r"[,;|\t\n]|\s{2,}", texts[0])]
        if len(texts) < 2:
            continue
        if len(texts) == count:
            return texts
        if len(texts) == count - 1 and first_rises:
            return ["time" if tells is _TELLS_NAMES else "", *texts]
        if len(texts) == 2 * count:  # a row or a column of names, then one of units
            for called, units in ((texts[:count], texts[count:]), (texts[::2], texts[1::2])):
                if all(unit_or_none(unit) is not None for unit in units):
                    return [f"{called[k]} [{units[k]}]" for k in range(count)]
        if one in fields:
            found.remarks.append(
                f"{one} has {len(texts)} texts, and {key} {count} columns: it is not used"
            )
    return []


def _columns(array: AnyArray) -> Iterator[AnyArray]:
    """Yield the columns of a matrix, the rows where these are longer; a vector is one."""
    if array.ndim == 2 and 1 in array.shape:
        array = array.ravel()
    if array.ndim < 2:
        yield array
    else:
        yield from array.T if array.shape[0] >= array.shape[1] else array


def _scalar(node: object) -> float | None:
    """Return the number of a node that is a single one, None where it is none."""
    if not isinstance(node, Leaf) or node.array.dtype.kind not in "fiu" or node.array.size != 1:
        return None
    return float(node.array.ravel()[0])


def _vector(node: object) -> AnyArray | None:
    """Return the numbers of a node that is a vector, None where it is none."""
    if not isinstance(node, Leaf) or node.array.dtype.kind not in "fiub" or node.array.size < 2:
        return None
    if node.array.ndim == 1:
        return node.array
    return node.array.ravel() if node.array.ndim == 2 and 1 in node.array.shape else None


def _texts(node: object) -> list[str]:
    """Return the texts in a list, or a text alone, [] where there is anything else."""
    if isinstance(node, str):
        return [node.strip()]
    if not isinstance(node, list) or not node:
        return []
    found = [_texts(one) for one in node]
    return [one[0] for one in found] if all(len(one) == 1 for one in found) else []


def _get(node: Mapping[str, Any], names: tuple[str, ...]) -> Any:
    """Return the field of one of some names, upper and lower case alike; None if there is none."""
    by_lower = {key.lower(): value for key, value in node.items()}
    return next((by_lower[name] for name in names if name in by_lower), None)


def _rises(array: AnyArray) -> bool:
    """Return whether numbers increase from each to the next, as a time does."""
    if array.dtype.kind not in "fiu" or len(array) < SHORTEST:
        return False
    return bool((np.diff(np.asarray(array, dtype=float)) > 0.0).all())


def _is_time_name(key: str) -> bool:
    short = _short(key)
    return short in _TIMES or "time" in short


def _short(key: str) -> str:
    return re.sub("[ -]", "_", key.rpartition(".")[2].lower())


def _header(fields: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """Return what stands beside Channel_1_Data as Channel_1_Header, as catman writes it."""
    found = fields.get(f"{key.removesuffix('_Data')}_Header")
    return found if isinstance(found, dict) else {}


def _unit_beside(fields: Mapping[str, Any], key: str) -> str:
    """Return a vector's unit: its own, one in a structure of units, or a text named after it."""
    every = [one for name, one in fields.items() if _TELLS_UNITS.search(name)]
    texts = [
        getattr(fields[key], "unit", ""),
        _unit_of(_header(fields, key)),
        *(one.get(key) for one in every if isinstance(one, dict)),
        *(fields.get(f"{key}{ending}") for ending in ("_unit", "_units", "Unit")),
        _unit_of(fields) if key.lower() in _VALUES else "",
    ]
    return next((text for text in texts if isinstance(text, str) and text), "")


def _unit_of(node: Mapping[str, Any]) -> str:
    """Return the unit that a signal states, itself or in the DataInfo of a time series."""
    info = _get(node, ("datainfo",))
    texts = [_get(one, _UNITS) for one in (node, info) if isinstance(one, dict)]
    texts += [_get(one, _NAMES) for one in texts if isinstance(one, dict)]  # an object of MATLAB
    return next((text for text in texts if isinstance(text, str)), "")
