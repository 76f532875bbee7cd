"""How far any control of a scenario's damper could lower a peak or RMS: the limit.

    from bristle.optimal_control import limit
    found = limit("el_centro_0p6g_constant_voltage")
    found.value, found.bound, found.previews, found.sure

The ground motion is known in advance and the voltage is free. The derivative of the response by the
voltage's history makes the search short; `Limit` says how sure the outcome is.
"""

from __future__ import annotations

from .limit import Limit, Start, limit

__all__ = ["Limit", "Start", "limit"]
