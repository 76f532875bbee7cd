"""FMU: a trained policy, a small network on an estimate of building and ground."""

from bristle.component.controller import POLICY
from bristle.fmu.controller import LinearSlave, declare_trained


class TrainedPolicy(LinearSlave):
    """Trained policy: the voltage that training on many ground motions found for such a state."""

    design = "policy"
    law_kind = POLICY
    command_unit = "V"
    files = ("component/data/policy.json",)

    def declare_law(self):
        super().declare_law()
        declare_trained(self)
