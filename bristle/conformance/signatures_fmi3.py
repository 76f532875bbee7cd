"""The functions of FMI 3.0 co-simulation: names, argument types, results."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_bool, c_char_p, c_double, c_int32, c_size_t, c_uint32, c_void_p
from typing import Any

_refs, _state, _sizes = POINTER(c_uint32), c_void_p, POINTER(c_size_t)
_flag, _numbers, _qualifiers = POINTER(c_bool), POINTER(c_double), POINTER(ctypes.c_int)
_counters = POINTER(ctypes.c_uint64)
TYPES: dict[str, Any] = {
    "Float64": c_double, "Float32": ctypes.c_float, "Boolean": c_bool, "String": c_char_p,
    "Int8": ctypes.c_int8, "UInt8": ctypes.c_uint8, "Int16": ctypes.c_int16,
    "UInt16": ctypes.c_uint16, "Int32": c_int32, "UInt32": c_uint32,
    "Int64": ctypes.c_int64, "UInt64": ctypes.c_uint64,
}  # fmt: skip
NATURAL = {
    "Real": "Float64", "Integer": "Int32", "Enumeration": "Int64", "Boolean": "Boolean",
    "String": "String",
}  # fmt: skip
"""The type of a kind of FMI 2.0 where nothing else is said."""
LOGGER = ctypes.CFUNCTYPE(None, c_void_p, ctypes.c_int, c_char_p, c_char_p)

_values = {
    f"fmi3{verb}{name}": (c_void_p, _refs, c_size_t, POINTER(kind), c_size_t)
    for verb in ("Get", "Set")
    for name, kind in TYPES.items()
}
REQUIRED = {
    "fmi3GetVersion": (),
    "fmi3SetDebugLogging": (c_void_p, c_bool, c_size_t, POINTER(c_char_p)),
    "fmi3InstantiateCoSimulation": (
        *(c_char_p, c_char_p, c_char_p, c_bool, c_bool, c_bool, c_bool),
        *(_refs, c_size_t, c_void_p, LOGGER, c_void_p),
    ),
    "fmi3FreeInstance": (c_void_p,),
    "fmi3EnterInitializationMode": (c_void_p, c_bool, c_double, c_double, c_bool, c_double),
    "fmi3ExitInitializationMode": (c_void_p,),
    "fmi3Terminate": (c_void_p,),
    "fmi3Reset": (c_void_p,),
    "fmi3DoStep": (c_void_p, c_double, c_double, c_bool, _flag, _flag, _flag, _numbers),
    **_values,
}
OPTIONAL = {
    "fmi3GetFMUState": (c_void_p, POINTER(_state)),
    "fmi3SetFMUState": (c_void_p, _state),
    "fmi3FreeFMUState": (c_void_p, POINTER(_state)),
    "fmi3SerializedFMUStateSize": (c_void_p, _state, _sizes),
    "fmi3SerializeFMUState": (c_void_p, _state, c_char_p, c_size_t),
    "fmi3DeserializeFMUState": (c_void_p, c_char_p, c_size_t, POINTER(_state)),
    "fmi3GetDirectionalDerivative": (
        (c_void_p, _refs, c_size_t, _refs, c_size_t, _numbers, c_size_t, _numbers, c_size_t)
    ),
    "fmi3GetAdjointDerivative": (
        (c_void_p, _refs, c_size_t, _refs, c_size_t, _numbers, c_size_t, _numbers, c_size_t)
    ),
    "fmi3GetOutputDerivatives": (c_void_p, _refs, c_size_t, POINTER(c_int32), _numbers, c_size_t),
    "fmi3GetBinary": (c_void_p, _refs, c_size_t, _sizes, c_void_p, c_size_t),
    "fmi3SetBinary": (c_void_p, _refs, c_size_t, _sizes, c_void_p, c_size_t),
    "fmi3GetClock": (c_void_p, _refs, c_size_t, _flag),
    "fmi3SetClock": (c_void_p, _refs, c_size_t, _flag),
    "fmi3GetIntervalDecimal": (c_void_p, _refs, c_size_t, _numbers, _qualifiers),
    "fmi3GetIntervalFraction": (c_void_p, _refs, c_size_t, _counters, _counters, _qualifiers),
    "fmi3GetShiftDecimal": (c_void_p, _refs, c_size_t, _numbers),
    "fmi3GetShiftFraction": (c_void_p, _refs, c_size_t, _counters, _counters),
    "fmi3SetIntervalDecimal": (c_void_p, _refs, c_size_t, _numbers),
    "fmi3SetIntervalFraction": (c_void_p, _refs, c_size_t, _counters, _counters),
    "fmi3SetShiftDecimal": (c_void_p, _refs, c_size_t, _numbers),
    "fmi3SetShiftFraction": (c_void_p, _refs, c_size_t, _counters, _counters),
    "fmi3GetNumberOfVariableDependencies": (c_void_p, c_uint32, _sizes),
    "fmi3GetVariableDependencies": (
        (c_void_p, c_uint32, _sizes, _refs, _sizes, _qualifiers, c_size_t)
    ),
    "fmi3EnterEventMode": (c_void_p,),
    "fmi3EnterStepMode": (c_void_p,),
    "fmi3UpdateDiscreteStates": (c_void_p, _flag, _flag, _flag, _flag, _flag, _numbers),
    "fmi3EvaluateDiscreteStates": (c_void_p,),
    "fmi3EnterConfigurationMode": (c_void_p,),
    "fmi3ExitConfigurationMode": (c_void_p,),
}
RESULTS: dict[str, Any] = {
    "fmi3GetVersion": c_char_p,
    "fmi3InstantiateCoSimulation": c_void_p,
    "fmi3FreeInstance": None,
}
