"""The C of a native FMU in its archive, for hosts that compile it themselves."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, fromstring

from .description import text_of
from .parts import shim_files

FOLDER = "sources"
FUNCTIONS, TABLES = "functions.c", "tables.c"


def source_members(text: Path, table: str, fmi: int) -> dict[str, bytes]:
    """Return what goes into the archive, by its path there.

    Parameters
    ----------
    text : Path
        The C of the component's functions.
    table : str
        That of its tables.
    fmi : int
        2 or 3: the version of FMI.
    """
    members = {path.name: path.read_bytes() for path in shim_files(fmi)}
    members |= {FUNCTIONS: text.read_bytes(), TABLES: table.encode()}
    return {f"{FOLDER}/{name}": data for name, data in members.items()}


def described(description: str, members: dict[str, bytes], fmi: int) -> dict[str, bytes]:
    """Return the files of an archive that tell a host what to compile, by their path.

    FMI 2.0 has the list in the model description, FMI 3.0 in a file of its own.

    Parameters
    ----------
    description : str
        The model description without the list.
    members : dict
        As `source_members` returns them.
    fmi : int
        2 or 3: the version of FMI.
    """
    names = sorted(Path(path).name for path in members if path.endswith(".c"))
    root = fromstring(description)
    simulation = root.find("CoSimulation")
    assert simulation is not None  # every component is for co-simulation
    if fmi == 2:
        files = Element("SourceFiles")
        for name in names:
            SubElement(files, "File", name=name)
        simulation.insert(0, files)
        return {"modelDescription.xml": text_of(root).encode()}
    about = Element("fmiBuildDescription", fmiVersion="3.0")
    model = simulation.get("modelIdentifier", "")
    configuration = SubElement(about, "BuildConfiguration", modelIdentifier=model)
    files = SubElement(configuration, "SourceFileSet", language="C11")
    for name in names:
        SubElement(files, "SourceFile", name=name)
    return {
        "modelDescription.xml": description.encode(),
        f"{FOLDER}/buildDescription.xml": text_of(about).encode(),
    }
