"""The mount between rod and structure gives way."""

from ..effect import Effect, Parameter


class MountCompliance(Effect):
    """Mount compliance: a spring and a dashpot in series with the fluid, with a small joint mass.

        mass v_joint' = k s + c s' - F_fluid,   s = x_rod - x_joint,   force outside = k s + c s'

    The joint's mass regularises the falling branch of the viscous part, on which a bare spring
    would jump. Leaves out play (see backlash).
    """

    name = "mount_compliance"
    site = "damper"
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
    parameters = {
        "k": Parameter(2e4, "N/m", (1e2, 1e9), "stiffness of the mount"),
        "c": Parameter(60.0, "N.s/m", (0.0, 1e6), "damping of the mount"),
        "mass": Parameter(0.004, "kg", (1e-5, 10.0), "mass of the joint"),
    }

    @staticmethod
    def motion(q, z, p):
        return q.rod_x - z.compression, z.joint_velocity

    @staticmethod
    def reaction(q, z, p):
        return p.k * z.compression + p.c * (q.rod_v - z.joint_velocity)

    @staticmethod
    def rate(q, z, p):
        slip = q.rod_v - z.joint_velocity
        return slip, (p.k * z.compression + p.c * slip - q.force) / p.mass
