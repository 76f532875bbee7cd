"""Names that SSP, OSP and OMSimulator give to things."""

from __future__ import annotations

STRUCTURE = "SystemStructure.ssd"
FMU_TYPE = "application/x-fmu-sharedlibrary"
SSD_TYPE = "application/x-ssp-definition"

OSP = "com.opensimulationplatform"
"""Type of an annotation that libcosim and Ecos read."""
OMS = "org.openmodelica"
"""Type of an annotation that OMSimulator reads."""
OWN = "bristle"
OWN_TYPE = "bristle.run"
"""Type of the annotation that tells the algorithm of a run."""
OSP_SYSTEM = "http://opensimulationplatform.com/MSMI/OSPSystemStructure"

_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = (
    ("ssd", f"{_SSP}Description"),
    ("ssc", f"{_SSP}Common"),
    ("ssv", f"{_SSP}ParameterValues"),
    ("osp", "http://opensimulationplatform.com/SSP/OSPAnnotations"),
    ("oms", "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"),
    (OWN, "urn:bristle"),
)
"""Prefixes and namespaces of what is written."""
