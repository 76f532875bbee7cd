"""What a check knows of a scenario while it reads it: the run, the components."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..core.config import Document
from ..core.text import command, nearest
from ..core.toml_lines import KeyPath
from ..fmu.description import Description, Value, Variable

ALGORITHMS = ("gauss-seidel", "midpoint", "midpoint-iterated", "jacobi")


@dataclass
class Run:
    """The run as far as it could be read; None where it could not."""

    stop: float | None = None
    step: float | None = None
    algorithm: str = ALGORITHMS[0]


@dataclass(frozen=True)
class DamperLaw:
    """The law of a damper that a scenario names.

    `name` is the law's, its form with it (see `physics.forms`), `component` what the catalogue
    makes it from, `file` that of a user's own law.
    """

    name: str
    component: str
    file: Path | None = None

    @property
    def shown(self) -> str:
        """What the component is called in messages and titles."""
        return Path(self.component).stem


@dataclass
class Part:
    """A component as far as it could be read; `places` gives the path of each parameter."""

    name: str
    path: KeyPath
    fmu: str = ""
    file: Path | None = None
    building: Path | None = None
    effects: tuple[Path, ...] = ()
    controller: Path | None = None
    law: DamperLaw | None = None
    step: float | None = None
    description: Description | None = None
    parameters: dict[str, Value] = field(default_factory=dict)
    places: dict[str, KeyPath] = field(default_factory=dict)
    over_step: dict[str, str] = field(default_factory=dict)

    @property
    def variables(self) -> dict[str, Variable]:
        """Variables of the FMU by name; none where it could not be read."""
        return self.description.variables if self.description else {}

    @property
    def ports_command(self) -> str:
        """The command that lists all ports; "" where its law was made for this scenario."""
        return "" if self.law else command("list", "ports", self.fmu)

    def value(self, name: str) -> Value | None:
        """Return a parameter's value as set, else its start value, else None."""
        variable = self.variables.get(name)
        return self.parameters.get(name, variable.start if variable else None)

    def real(self, name: str) -> float | None:
        """Return a parameter's value if it is a number."""
        value = self.value(name)
        return float(value) if isinstance(value, int | float) else None


def existing_file(
    value: str, folder: Path, path: KeyPath, where: str, document: Document
) -> Path | None:
    """Return the absolute path of a file; None, and an error, where there is none.

    Parameters
    ----------
    value : str
        Its name as the scenario has it.
    folder : Path
        Where relative names begin.
    path : tuple
        Keys from the top of the document to the value.
    where : str
        Words that begin the message.
    document : Document
        Takes what is found.
    """
    if "\0" in value:
        document.error(path, f"{where}: no file can have a null character in its name.")
        return None
    file = (folder / value).absolute()
    try:
        if file.is_file():
            return file
        # Names are alike by their endings alone, so these are left out.
        beside = {entry.stem: entry.name for entry in file.parent.glob(f"*{file.suffix}")}
    except OSError:
        beside = {}
    close = nearest(file.stem, beside)
    hint = f' Did you mean "{Path(value).parent / beside[close[0]]}"?' if close else ""
    document.error(path, f'{where}: there is no file "{value}" (looked for {file}).{hint}')
    return None
