"""The functions of FMI 2.0 co-simulation: names, argument types, results."""

from __future__ import annotations

from ctypes import POINTER, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from typing import Any

_refs, _state = POINTER(c_uint), c_void_p
TYPES: dict[str, Any] = {"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}
_VALUES = {
    f"fmi2{verb}{kind}": (c_void_p, _refs, c_size_t, POINTER(TYPES[kind]))
    for verb in ("Get", "Set")
    for kind in TYPES
}
OPTIONAL = {
    "fmi2GetFMUstate": (c_void_p, POINTER(_state)),
    "fmi2SetFMUstate": (c_void_p, _state),
    "fmi2FreeFMUstate": (c_void_p, POINTER(_state)),
    "fmi2SerializedFMUstateSize": (c_void_p, _state, POINTER(c_size_t)),
    "fmi2SerializeFMUstate": (c_void_p, _state, c_char_p, c_size_t),
    "fmi2DeSerializeFMUstate": (c_void_p, c_char_p, c_size_t, POINTER(_state)),
    "fmi2GetDirectionalDerivative": (
        (c_void_p, _refs, c_size_t, _refs, c_size_t, POINTER(c_double), POINTER(c_double))
    ),
    "fmi2SetRealInputDerivatives": ((c_void_p, _refs, c_size_t, POINTER(c_int), POINTER(c_double))),
    "fmi2GetRealOutputDerivatives": (
        (c_void_p, _refs, c_size_t, POINTER(c_int), POINTER(c_double))
    ),
    "fmi2CancelStep": (c_void_p,),
    "fmi2GetStatus": (c_void_p, c_int, POINTER(c_int)),
    "fmi2GetRealStatus": (c_void_p, c_int, POINTER(c_double)),
    "fmi2GetIntegerStatus": (c_void_p, c_int, POINTER(c_int)),
    "fmi2GetBooleanStatus": (c_void_p, c_int, POINTER(c_int)),
    "fmi2GetStringStatus": (c_void_p, c_int, POINTER(c_char_p)),
}
REQUIRED = {
    "fmi2GetTypesPlatform": (),
    "fmi2GetVersion": (),
    "fmi2SetDebugLogging": (c_void_p, c_int, c_size_t, POINTER(c_char_p)),
    "fmi2Instantiate": (c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int),
    "fmi2FreeInstance": (c_void_p,),
    "fmi2SetupExperiment": (c_void_p, c_int, c_double, c_double, c_int, c_double),
    "fmi2EnterInitializationMode": (c_void_p,),
    "fmi2ExitInitializationMode": (c_void_p,),
    "fmi2Terminate": (c_void_p,),
    "fmi2Reset": (c_void_p,),
    "fmi2DoStep": (c_void_p, c_double, c_double, c_int),
    **_VALUES,
}
RESULTS: dict[str, Any] = {
    "fmi2GetTypesPlatform": c_char_p,
    "fmi2GetVersion": c_char_p,
    "fmi2Instantiate": c_void_p,
    "fmi2FreeInstance": None,
}
