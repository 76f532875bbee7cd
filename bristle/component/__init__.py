"""Components as pure functions on flat sequences: what FMUs and the coupled engine both run.

A module per component has

    sizes(values, baked, counts)
        Fill in how many floats constants, state, outputs (hidden ones too) and work take.
    setup(values, given, baked, store, state)
        Fill in what parameters imply, and the state at the start.
    constants(store)
        Return the record that the functions below take; its rows are slices of `store`, in compiled
        code views.
    start(time, inputs, c, state, outputs, work)
        Put the state to where it is before the first step; it follows the inputs until then.
    step(clock, before, now, c, state, new_state, outputs, work)
        Advance over one step from the inputs before to those now; `clock` is (time [s] at the
        begin, dt [s], sweep). The caller takes over `new_state`, or sweeps again from `state`. The
        outputs are those that `output` would give.
    output(time, inputs, c, state, outputs, work)
        Give the outputs of a state at inputs that may have changed since the step.

and where there is a need for it

    bind(given, store)
        Take over which inputs a host has set: whenever that has changed, before `constants`.
    follow(inputs, c)
        Let parameters follow inputs: before each start, step and output.
    discretise(dt, store, work)
        Fill in what the length of the step [s] implies: before `constants`, and before a step whose
        length differs from that of the last one.
    scale_samples(times, samples, store)
        Take over what the samples of a signal imply: once they are there, after `setup`.

`constants`, `discretise` and `scale_samples` are called by the names of what they take; any of the
rows may be among it. `values` are the parameters in their order: a whole number or a switch as a
float, a text that is one of its `words` as the index of the word, -1 where it is none of them, any
other text as 0; `given` holds 1 for each input that a host has set, else 0; `baked` is what a build
fixes, as the module's `bake` lays it down in plain Python; `store`, `state` and work come with
zeros in them.

Each returns a code: 0; above 0 what the component warns of; below 0 why it cannot go on. The text
belongs to the component's class. `state` and `new_state`, `before` and `now`, `outputs` and `work`
are sequences of floats: lists inside FMUs, arrays in compiled code.
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
