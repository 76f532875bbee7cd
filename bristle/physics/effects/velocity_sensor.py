"""The velocity transducer follows late and with a gain of its own."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


class VelocitySensor(Effect):
    """Velocity sensor: the instrument low-passes the velocity and scales it.

        shown = gain H v,   H = 1/(1 + tau p + shape tau^2 p^2)  p/(p + corner)

    Shape 0 is a first-order lag, more a seismic transducer of second order (shape 1/(4 D^2) for a
    damping ratio D); `corner` [rad/s] is a geophone's high-pass, 0 none. Leaves out drift and
    cross-axis motion: doubt it when the channel does not return to zero at rest.
    """

    name = "velocity_sensor"
    sites = ("sensor",)
    shows = "velocity"
    needs = ("value", "dt")
    passive = False
    zero_at_rest = True
    source = "Doebelin (2004), Measurement Systems, 5th ed., ch. 3 and 4"
    expect = (
        "velocity is not the rate of displacement: too small or too late, most at high frequency"
    )
    states = {"low": "m/s", "rate": "m/s", "drift": "m/s"}
    starts = {"low": "value"}
    amount = "tau"
    parameters = {
        "gain": Parameter(1.0, "1", (0.2, 5.0), "shown by true velocity"),
        "tau": Parameter(0.005, "s", (0.0, 0.2), "time constant of the low-pass"),
        "shape": Parameter(0.25, "1", (0.0, 2.0), "0 first order, 0.25 and more second order"),
        "corner": Parameter(1.0, "1/s", (0.0, 100.0), "corner of the high-pass; 0: none"),
    }
    start_grid = {"tau": (0.3, 1.0)}
    faults = ("lag", "high-pass")

    @staticmethod
    def channel(q, z, p):
        return p.gain * (z.low - z.drift)

    @staticmethod
    def advance(q, z, p):
        h = q.dt
        low, rate = q.value, 0.0
        if p.tau > 0.0 and p.shape * p.tau < 0.01 * h:
            low = q.value + (z.low - q.value) * exp(-h / p.tau)
        elif p.tau > 0.0:
            # Trapezoidal rule for tau rate' shape = value - low - rate, low' = rate/tau.
            stiff = p.shape * p.tau
            rest = 0.5 * h / p.tau
            right = z.rate * (stiff - 0.5 * h - 0.5 * h * rest) + h * (q.value - z.low)
            rate = right / (stiff + 0.5 * h + 0.5 * h * rest)
            low = z.low + rest * (z.rate + rate)
        keep = exp(-p.corner * h)
        return low, rate, low + (z.drift - low) * keep
