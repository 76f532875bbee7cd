"""What a macro step consists of: which inputs to set, which outputs to read, and when.

An output whose `dependencies` name an input follows that input without a step. In row k such
outputs are read after the inputs of t_k were set, all others directly after the step. The
schedule is worked out once, from the connections alone, and asks for no call that is not needed:

- Gauss-Seidel: each component in turn gets the inputs that are newer than those it has, steps,
  and is read. At the end of the step, inputs whose source came later are set wherever an output
  follows them, and these outputs are read for the row; what they feed directly follows.
- Midpoint: as Gauss-Seidel, but an input that a component holds over its step has the middle of
  the step there: half-way between the last value and the newest where the source has stepped
  already, ahead of the newest by half its last change where it has not. Before outputs that follow
  it are read it gets the value at the step's end. What a component interpolates or samples, and
  what is discrete, gets the newest value.
- Midpoint, iterated: the components of a loop then go back to the begin of the step and make it
  again, with the middle between the values at its begin and those found at its end.
- Jacobi: all step, all are read, all inputs are set; outputs that follow an input are read again
  for the row and not passed on.

A loop of outputs that follow inputs has no order. It is cut where the order of the components
closes it: within a step each value of the loop is taken once. An output without `dependencies`
(None) may follow every input of its component, so it is read again after each of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from .graph import Refresh, at_level, lay_out
from .operations import (
    NEWEST,
    Node,
    Operation,
    Port,
    Schedule,
    Step,
    is_continuous,
    reads,
    writes,
)
from .sequence import in_sequence


def make_schedule(nodes: Sequence[Node], algorithm: str) -> Schedule:
    """Return the schedule of a macro step for one of `scenario.parts.ALGORITHMS`."""
    if algorithm == "jacobi":
        return _jacobi(nodes)
    if algorithm == "gauss-seidel":
        return in_sequence(nodes, ())
    return in_sequence(nodes, held_inputs(nodes), iterated=algorithm == "midpoint-iterated")


def held_inputs(nodes: Sequence[Node]) -> set[Port]:
    """Return the inputs that midpoint gives the middle of the step: held, of signals that go on.

    A continuous output that may jump, as dry friction does where the motion turns, is better off
    with the newest values all round, which is Gauss-Seidel.
    """
    rough = {
        (c, name)
        for c, node in enumerate(nodes)
        for output in node.outputs
        if is_continuous(node.outputs[output]) and node.jumps(output)
        for name in node.followed(output)
    }
    return {
        (c, name)
        for c, node in enumerate(nodes)
        for name, (d, output) in node.sources.items()
        if node.holds(name) and not nodes[d].jumps(output)
    } - rough


def _jacobi(nodes: Sequence[Node]) -> Schedule:
    refresh = Refresh(
        outputs={(c, o): 1 for c, n in enumerate(nodes) for o in n.outputs if n.followed(o)}
    )
    passed_on = {source for node in nodes for source in node.sources.values()}
    early = [
        [o for o in node.outputs if (c, o) in passed_on or (c, o) not in refresh.outputs]
        for c, node in enumerate(nodes)
    ]
    operations: list[Operation] = [Step(c) for c in range(len(nodes))]
    for c, node in enumerate(nodes):
        operations += reads(c, node, early[c])
    for c, node in enumerate(nodes):
        operations += writes(c, node, dict.fromkeys(node.sources, NEWEST))
    for c, node in enumerate(nodes):
        operations += reads(c, node, at_level(refresh.outputs, c, 1))
    return Schedule(tuple(operations), lay_out(nodes, refresh, early))
