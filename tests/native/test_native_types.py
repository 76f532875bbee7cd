"""Values that are got as those of another type: both forms answer, and warn."""

from __future__ import annotations

import math

from both_forms import Both, native, needs_zig

from bristle.conformance.native import ERROR, OK, WARNING
from bristle.fmu.slave import Slave
from bristle.native.prepare import component_of
from bristle.fmu.plan import plan

pytestmark = needs_zig
