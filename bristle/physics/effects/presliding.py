"""Elastic yielding before the Bingham law slides."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


class Presliding(Effect):
    """Presliding: the yield force builds up over a short travel instead of jumping with direction.

        d(w)/d|x| = -w^shape / x_s,   w = 1 - direction * s,   s = sgn(v);   |direction| <= 1

    Dahl's model for shape 1, an elastic-plastic spring for shape 0; exact in the travel.
    Leaves out rate: doubt it when the build-up differs between slow and fast reversals.
    """

    name = "presliding"
    sites = ("damper",)
    needs = ("v", "dt")
    passive = True
    zero_at_rest = True
    source = "Dahl (1976), AIAA Journal 14(12), 1675-1682"
    expect = "after each reversal the force turns over a short travel instead of at once"
    states = {"direction": "1"}
    amount = "x_s"
    parameters = {
        "x_s": Parameter(5e-4, "m", (1e-7, 0.1), "travel over which the yield force builds up"),
        "shape": Parameter(1.0, "1", (0.0, 3.0), "0 elastic-plastic, 1 Dahl, above: a long tail"),
    }
    start_grid = {"x_s": (0.03, 0.1, 0.3, 1.0)}
    family = "series"  # elastic before it slides

    @staticmethod
    def yield_force(q, z, p):
        return z.direction

    @staticmethod
    def advance(q, z, p):
        travel = abs(q.v) * q.dt / p.x_s
        if travel <= 0.0:
            return (z.direction,)
        side = 1.0 if q.v > 0.0 else -1.0
        left = max(1.0 - side * z.direction, 0.0)
        power = 1.0 - p.shape
        if abs(power) < 1e-6:
            left = left * exp(-travel)
        elif left > 0.0:
            rest = left**power - power * travel
            left = rest ** (1.0 / power) if rest > 0.0 else 0.0
        return (side * (1.0 - left),)
