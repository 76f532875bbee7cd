"""All probes, in the order of the table."""

from ..probe import PROBES as _ENTERED
from . import derivatives, ending, faults, file, instances, order, run, state, values

__all__ = ["PROBES"]

PROBES = {
    name: probe
    for module in (file, run, instances, ending, order, values, derivatives, state, faults)
    for name, probe in _ENTERED.items()
    if probe.run.__module__ == module.__name__
}
