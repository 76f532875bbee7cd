"""Components that step one after another: Gauss-Seidel, midpoint, midpoint with one rollback."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from ..fmu.description import Variable
from .graph import at_level, find_late, lay_out, loop_members, read_early, signal_graph
from .operations import (
    AHEAD,
    ALONG,
    END,
    MIDDLE,
    NEWEST,
    PAST,
    Keep,
    Node,
    Operation,
    Port,
    Ramp,
    Restore,
    Save,
    Schedule,
    Shift,
    Step,
    is_continuous,
    reads,
    writes,
)


def in_sequence(nodes: Sequence[Node], held: Collection[Port], iterated: bool = False) -> Schedule:
    """Return the schedule in which each component gets the newest values, and then steps.

    Parameters
    ----------
    nodes : sequence of Node
    held : inputs that get the middle of the step; none of them: Gauss-Seidel
    iterated : whether the components of a loop go back once and step again, now that the values
        at the end of the step are known
    """
    plan = _Plan(nodes, held, iterated)
    for _ in range(2):  # the last period is the steady one
        plan.macro_step()
    return Schedule(tuple(plan.operations), lay_out(nodes, plan.refresh, plan.early))


class _Plan:
    """The operations of a macro step while they are worked out."""

    def __init__(self, nodes: Sequence[Node], held: Collection[Port], iterated: bool) -> None:
        self.nodes, self.held = nodes, held
        inside, behind = loop_members(nodes) if iterated else ([], [])
        self.again, self.behind = inside, behind
        self.graph = signal_graph(nodes)
        self.refresh = find_late(nodes, self.graph)
        fed_back = {source for c in inside for source in nodes[c].sources.values()}
        self.early = read_early(nodes, self.refresh, fed_back)
        self.kept = {nodes[c].sources[name] for c, name in held}
        along = {nodes[c].sources[name] for c in range(len(nodes)) for name in self._along(c)}
        self.kept_for_substeps = along - self.kept
        self.jumping = self._jumping()
        self.operations: list[Operation] = []
        # When each output was read and each input written: only inputs that are older are set.
        self._read: dict[Port, int] = defaultdict(int)
        self._written: dict[Port, int] = defaultdict(lambda: 1)
        # When each input had its source's newest value, and when that was read for the last row.
        self._current: dict[Port, int] = defaultdict(lambda: 1)
        self._row: dict[Port, int] = {}
        self._clock = 1

    def macro_step(self) -> None:
        """Work out a macro step that follows on those before."""
        self.operations = []
        self._row = dict(self._read)
        for c in self.again:
            late = [n for n in self._older(c) if self.nodes[c].sources[n][0] >= c]
            self._write(c, dict.fromkeys(late, NEWEST))
            self.operations.append(Save(c))
        for c in range(len(self.nodes)):
            if c not in self.behind:
                self._step(c)
        if self.again:
            self.operations += [Restore(c) for c in self.again]
            for c in self.again:
                self._step_again(c)
            for c in self.behind:
                self._step(c)
        self._refresh()

    def _older(self, c: int) -> list[str]:
        """Return the inputs with the newest value whose source is newer than they are."""
        return [
            name
            for name, source in self.nodes[c].sources.items()
            if (c, name) not in self.held and self._read[source] > self._written[c, name]
        ]

    def _held(self, c: int) -> list[str]:
        return [name for name in self.nodes[c].sources if (c, name) in self.held]

    def _write(self, c: int, values: Mapping[str, str], if_changed: bool = False) -> None:
        self._clock += 1
        self._written.update({(c, name): self._clock for name in values})
        self._give(c, values, if_changed)

    def _give(self, c: int, values: Mapping[str, str], if_changed: bool = False) -> None:
        newest = (name for name, value in values.items() if value == NEWEST)
        self._current.update({(c, name): self._clock for name in newest})
        found = writes(c, self.nodes[c], values)
        self.operations += [replace(one, if_changed=if_changed) for one in found]

    def _read_outputs(self, c: int, names: Iterable[str]) -> None:
        self.operations += reads(c, self.nodes[c], names)

    def _step(self, c: int) -> None:
        node = self.nodes[c]
        stepped = {name: self._has_stepped(node.sources[name][0], c) for name in self._held(c)}
        values = {name: MIDDLE if stepped[name] else AHEAD for name in stepped}
        values.update(dict.fromkeys(self._older(c), NEWEST))
        ramped = self._ramped_by_others(c)
        values.update({name: PAST if stepped[name] else NEWEST for name in ramped})
        own = not ramped and self._ramps_alone(c, stepped)
        if own:
            values, ramped = dict.fromkeys(self._older(c), NEWEST), tuple(stepped)
        along = self._along(c)
        rest = (name for name in node.sources if name in values and name not in along)
        self._write(c, {name: values[name] for name in rest}, own)
        self.operations += [Ramp(c, ramped)] if ramped else []
        kept = self.kept | self.kept_for_substeps
        past = tuple(name for name in node.outputs if (c, name) in kept)
        self.operations += [Keep(c, past)] if past else []
        self._substeps(c, along)
        self._current.update({(c, name): self._clock for name in ramped if stepped[name]})
        self._show(c, {name: known for name, known in stepped.items() if name not in ramped})

    def _along(self, c: int) -> list[str]:
        """Return the inputs that move on substep by substep: their source's end is known."""
        node = self.nodes[c]
        known = (name for name, (d, _) in node.sources.items() if self._has_stepped(d, c))
        return [name for name in known if node.moves(name)]

    def _substeps(self, c: int, along: Sequence[str]) -> None:
        """Let a component step, and have these inputs arrive at their newest value with it."""
        given = writes(c, self.nodes[c], dict.fromkeys(along, ALONG))
        self.operations.append(Step(c, tuple(given)))
        self._written.update({(c, name): self._clock for name in along})

    def _ramped_by_others(self, c: int) -> tuple[str, ...]:
        """Return the held inputs that a foreign FMU interpolates over its step.

        It gets value and derivative; how it takes them over the step is its own matter.
        """
        node = self.nodes[c]
        found = (name for name in self._held(c) if node.inputs[name].over_step is None)
        return tuple(name for name in found if name in node.interpolates)

    def _ramps_alone(self, c: int, stepped: Mapping[str, bool]) -> bool:
        """Return whether derivatives in place of the middle save a call, and mean the same.

        They do where end values would be set behind the step, and no value that changes all the
        time is before it. One of bristle's FMUs holds the middle then, and goes on from where the
        step before has brought its inputs.
        """
        held, sources = set(stepped), self.nodes[c].sources
        able = held and held <= self.nodes[c].interpolates and not self.again
        if not able or not self._end_values(c, stepped):
            return False
        feeding = (sources[name] for name in self._older(c))
        if not all(_stands(self.nodes[d].outputs[output]) for d, output in feeding):
            return False
        return all(self._current[c, name] >= self._row.get(sources[name], 0) for name in held)

    def _has_stepped(self, source: int, c: int) -> bool:
        """Return whether a source steps before a component; those behind a loop come last."""
        return source < c or (c in self.behind and source not in self.behind)

    def _step_again(self, c: int) -> None:
        """Step from the restored state: the ends of all inputs are known, if only nearly."""
        node = self.nodes[c]
        before = [n for n, (d, _) in node.sources.items() if d < c and (c, n) not in self.held]
        values, ramped = dict.fromkeys(self._held(c), MIDDLE), self._ramped_by_others(c)
        values.update(dict.fromkeys(ramped, PAST))
        along = self._along(c)
        self._write(c, {**{n: NEWEST for n in before if n not in along}, **values})
        self.operations += [Ramp(c, ramped)] if ramped else []
        self._substeps(c, along)
        self._show(c, dict.fromkeys((name for name in values if name not in ramped), True))

    def _show(self, c: int, known: Mapping[str, bool]) -> None:
        """Give held inputs the end of the step for the outputs that follow them, and read these.

        Where others wait for such an output it is now, from a source that has still to step as far
        as that can be told; else it is when all have stepped, unless nothing else is set then.

        Parameters
        ----------
        c : the component
        known : held inputs, and whether their value at the end is known
        """
        self._give(c, self._end_values(c, known))
        self._read_outputs(c, self.early[c])
        self._read.update({(c, name): self._clock for name in self.early[c]})

    def _end_values(self, c: int, known: Mapping[str, bool]) -> dict[str, str]:
        """Return what is set behind a step, as `_show` says."""
        values = {}
        for name in known:
            following = {output for _, output in self.graph[c, name]}
            wanted = following.intersection(self.early[c])
            if wanted or (known[name] and following and (c, name) not in self.refresh.inputs):
                values[name] = NEWEST if known[name] else END
        return values

    def _refresh(self) -> None:
        """Set what came too late, and read what follows it, link by link."""
        for level in range(1, max(self.refresh.outputs.values(), default=0) + 1):
            for c in range(len(self.nodes)):
                seen = at_level(self.refresh.outputs, c, level)
                moved = tuple(name for name in seen if (c, name) in self.jumping)
                self._write(c, dict.fromkeys(at_level(self.refresh.inputs, c, level), NEWEST))
                self.operations += [Shift(c, moved, "-=")] if moved else []
                self._read_outputs(c, seen)
                self.operations += [Shift(c, moved, "+=")] if moved else []
            changed = [port for port, at in self.refresh.outputs.items() if at == level]
            self._read.update(dict.fromkeys(changed, self._clock))
            self._clock += 1

    def _jumping(self) -> set[Port]:
        """Return the outputs whose change between two reads of a step is a jump, and no slope.

        They follow a discrete signal, as a damper's force does the voltage of a controller that has
        stepped after it.
        """
        queue = [
            (c, name)
            for c, node in enumerate(self.nodes)
            for name, (d, output) in node.sources.items()
            if d >= c and not is_continuous(self.nodes[d].outputs[output])
        ]
        reached: set[Port] = set()
        while queue:
            port = queue.pop()
            if port not in reached:
                reached.add(port)
                queue += self.graph[port]
        return {port for port in self.kept if port in reached and port[1] in self.early[port[0]]}


def _stands(output: Variable) -> bool:
    """Return whether a signal stands over many steps, as the voltage of a sampled controller."""
    return output.kind == "Real" and not is_continuous(output)
