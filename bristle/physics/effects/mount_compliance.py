"""The mount between rod and structure gives way."""

from ..effect import Effect
from ..parameter import Parameter

S_REF = 1e-3  # m


class MountCompliance(Effect):
    """Mount compliance: a spring and a dashpot in series with the fluid, with a small joint mass.

        mass v_joint' = F - F_fluid,   F = k s (1 + (s/s_h)^2) + c s',   s = x_rod - x_joint

    `hard` is (1 mm/s_h)^2: 0 a linear spring, more a rubber bush that stiffens. The joint's mass
    regularises the falling branch of the viscous part, on which a bare spring would jump.
    Leaves out play: doubt it when no force at all comes after a reversal (see backlash).
    """

    name = "mount_compliance"
    sites = ("damper",)
    kind = "series element"
    needs = ("rod_x", "rod_v", "force")
    passive = True
    zero_at_rest = True
    excludes = ("backlash",)
    source = "Makris & Constantinou (1991), J. Struct. Eng. 117(9), 2708-2724 (Maxwell element)"
    expect = (
        "the force turns late and softly after each reversal of the motion, by force over stiffness"
    )
    states = {"compression": "m", "joint_velocity": "m/s"}
    joint = ("compression", "joint_velocity")
    amount = "1/k"
    parameters = {
        "k": Parameter(2e4, "N/m", (1e2, 1e9), "stiffness of the mount"),
        "hard": Parameter(0.0, "1", (0.0, 1e4), "growth of the stiffness per square millimetre"),
        "c": Parameter(60.0, "N.s/m", (0.0, 1e6), "damping of the mount"),
        "mass": Parameter(4e-4, "kg", (1e-5, 10.0), "mass of the joint"),
    }
    start_grid = {"k": (0.3, 1.0, 3.0, 10.0)}
    family = "series"  # elastic before it slides

    @staticmethod
    def motion(q, z, p):
        return q.rod_x - z.compression, z.joint_velocity

    @staticmethod
    def reaction(q, z, p):
        bent = p.k * z.compression * (1.0 + p.hard * (z.compression / S_REF) ** 2)
        return bent + p.c * (q.rod_v - z.joint_velocity)

    @staticmethod
    def rate(q, z, p):
        slip = q.rod_v - z.joint_velocity
        bent = p.k * z.compression * (1.0 + p.hard * (z.compression / S_REF) ** 2)
        return slip, (bent + p.c * slip - q.force) / p.mass
