"""Control laws at run time: pure functions in the standard library, bundled in every FMU.

Laws take floats and flat sequences (lists inside FMUs, arrays under numba), one call per sample:

    inverse      voltage at which a damper gives a commanded force
    switching    clipped-optimal switch, signed voltage, limits
    linear       state-space controllers, one or a table of them, with anti-windup
    sensing      velocity from displacement and from acceleration, skyhook
    instrument   what a sensor shows of a signal
    controller   the file that a design writes and a controller reads
"""
