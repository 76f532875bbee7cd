"""Components as pure functions on flat sequences: what FMUs and the coupled engine both run.

A module per component has

    start(time, inputs, c, state, outputs, work)
        Put the state to where it is before the first step; it follows the inputs until then.
    step(clock, before, now, c, state, new_state, outputs, work)
        Advance over one step from the inputs before to those now; `clock` is (time [s] at the
        begin, dt [s], sweep). The caller takes over `new_state`, or sweeps again from `state`. The
        outputs are those that `output` would give.
    output(time, inputs, c, state, outputs, work)
        Give the outputs of a state at inputs that may have changed since the step.

Each returns a code: 0; above 0 what the component warns of; below 0 why it cannot go on. The text
belongs to the component's class. `c` is a record of what parameters and step imply, made once by
`setup` (and `discretise`, where the step's length counts); `state` and `new_state`, `before` and
`now`, `outputs` and `work` are sequences of floats: lists inside FMUs, arrays in compiled code.
What `work` holds lasts over the sweeps of one step. What is sampled is not swept: its `new_state`
is `state` itself. Inputs and outputs lie in the order of the
ports, hidden outputs behind them. No function here makes a list, raises, or knows a text.

Each input says how it is taken over a step (`OVER_STEP`). The coupled engine iterates a step until
motion and forces agree and may then take a held input as linear: `c.linear`.
"""

HELD, LINEAR, SAMPLED = "held", "linear", "sampled"
OVER_STEP = {
    HELD: "its newest value stands over the whole step",
    LINEAR: "it goes from the value before to the newest one",
    SAMPLED: "it is taken at the component's own instants",
}
"""How an input is taken over a step."""
