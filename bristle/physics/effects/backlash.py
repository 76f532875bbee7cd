"""Play in the joint between rod and structure."""

from ..effect import Effect
from ..parameter import Parameter

RISE = 0.02  # of the gap: indentation over which the damping sets in
LEAST = 1e-9  # m, the same where there is no gap


class Backlash(Effect):
    """Backlash: the joint carries no force until its gap is closed.

        force outside = k s' + c min(|s'|/d, 1) ds'/dt,   s' = s beyond +-gap,   s = x_rod - x_joint

    The damping sets in over an indentation d of 2 % of the gap, as in a contact whose loss grows
    with its indentation. With a jump of the force as the gap closes, no force would agree with the
    motion of a building at that moment. A small joint mass lets the fluid spring back inside the
    gap. Leaves out the rattle of the impacts: doubt it when the force rings after a gap has closed.
    """

    name = "backlash"
    sites = ("damper",)
    kind = "series element"
    needs = ("rod_x", "rod_v", "force")
    passive = True
    zero_at_rest = True
    excludes = ("mount_compliance",)
    source = (
        "Nordin & Gutman (2002), Automatica 38(10), 1633-1649 (physical model of Nordin et al. "
        "1997); damping over indentation: Hunt & Crossley (1975), J. Appl. Mech. 42(2), 440-445"
    )
    expect = "after each reversal of the force no force at all over the width of the gap"
    states = {"compression": "m", "joint_velocity": "m/s"}
    joint = ("compression", "joint_velocity")
    assumed = ("c",)  # felt while a gap closes, for less than a sample
    amount = "gap"
    parameters = {
        "gap": Parameter(2e-4, "m", (0.0, 0.05), "half the play"),
        "k": Parameter(1e5, "N/m", (1e3, 1e9), "stiffness of the closed joint"),
        "c": Parameter(80.0, "N.s/m", (0.0, 1e6), "damping of the closed joint"),
        "mass": Parameter(0.004, "kg", (1e-5, 10.0), "mass of the joint"),
    }
    start_grid = {"gap": (0.01, 0.017, 0.03, 0.05, 0.09, 0.15, 0.26, 0.45, 0.8, 1.3, 2.3, 4.0)}
    start_ties = ("k", "c")
    family = "series"  # elastic before it slides

    @staticmethod
    def motion(q, z, p):
        return q.rod_x - z.compression, z.joint_velocity

    @staticmethod
    def reaction(q, z, p):
        beyond = z.compression - min(max(z.compression, -p.gap), p.gap)
        if beyond == 0.0:
            return 0.0
        c = p.c * min(abs(beyond) / (RISE * p.gap + LEAST), 1.0)
        force = p.k * beyond + c * (q.rod_v - z.joint_velocity)
        # A joint pushes and never pulls: damping may unload it, not turn the contact round.
        return max(force, 0.0) if beyond > 0.0 else min(force, 0.0)

    @staticmethod
    def rate(q, z, p):
        slip = q.rod_v - z.joint_velocity
        beyond = z.compression - min(max(z.compression, -p.gap), p.gap)
        c = p.c * min(abs(beyond) / (RISE * p.gap + LEAST), 1.0)
        force = 0.0
        if beyond > 0.0:
            force = max(p.k * beyond + c * slip, 0.0)
        elif beyond < 0.0:
            force = min(p.k * beyond + c * slip, 0.0)
        return slip, (force - q.force) / p.mass

    @staticmethod
    def tie(p, sizes):
        # A closed contact gives by a small part of its gap, and hardly bounces.
        k = 20.0 * sizes.force / p.gap
        return k, max(sizes.force / sizes.v, (k * p.mass) ** 0.5)
