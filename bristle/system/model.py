"""A scenario as plain data, and what a check knows of it while it reads it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..core.config import Document
from ..core.finding import Finding, worded
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


@dataclass(frozen=True)
class Component:
    """One FMU of a scenario.

    `path` is the file of a foreign FMU, None for a built-in; `building` the data file that a
    Structure is made from, None for the default; `controller` the controller file of a designed
    controller, None for the one that it carries; `effects` the files of a user's own effects that a
    built-in one carries besides the library's; `parameters` the values that the scenario sets,
    inputs that are held constant included; `step` its own step [s], None for the run's; `law` that
    of a damper where the scenario names it; `over_step` what the scenario says of a foreign FMU's
    ports (see `parameters.choose_over_step`).
    """

    name: str
    fmu: str
    path: Path | None
    building: Path | None
    parameters: dict[str, Value]
    step: float | None
    description: Description
    effects: tuple[Path, ...] = ()
    controller: Path | None = None
    law: DamperLaw | None = None
    over_step: dict[str, str] = field(default_factory=dict)

    def made_of(self) -> str:
        """Return what the catalogue makes it from; a law of a user's own is registered then."""
        if self.law is None:
            return self.fmu
        if self.law.file is not None:  # this process may not have read it yet
            from ..trust import load_file

            load_file(self.law.file, "law")
        return self.law.component


@dataclass(frozen=True)
class Connection:
    """Component and port that take a value, component and port that give it.

    input = factor output + offset; `transformed` is whether the scenario says so, even if by 1 and
    0: units are its own matter then. `path` leads to its key in the file.
    """

    target: str
    input: str
    source: str
    output: str
    factor: float = 1.0
    offset: float = 0.0
    transformed: bool = False
    path: KeyPath = field(default=(), compare=False, repr=False)

    @property
    def changes(self) -> bool:
        """Whether a value changes on its way."""
        return (self.factor, self.offset) != (1.0, 0.0)

    def given(self, value: float) -> float:
        """Return what the input gets where the output has a value."""
        return self.factor * value + self.offset


@dataclass(frozen=True)
class Scenario:
    """A checked scenario; `stop` [s] is a whole number of steps of `step` [s].

    `title` is the file's unless overrides changed what runs (see `library.changed_title`).

    `algorithm` is one of `ALGORITHMS`; components step in their order. `findings` are the
    warnings and notes of its check; `overrides` what was laid over the file. `package` is the SSP
    package that it was read from, None without one.
    """

    file: Path
    title: str
    stop: float
    step: float
    algorithm: str
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    findings: tuple[Finding, ...] = ()
    overrides: dict[str, object] = field(default_factory=dict)
    package: Path | None = None

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return round(self.stop / self.step)

    def remarks(self) -> list[str]:
        """Return the warnings and notes of the check, a line each with its place."""
        name = (self.package or self.file).name
        return [f"{found.level}: {worded(name, found)}" for found in self.findings]

    def component(self, name: str) -> Component:
        """Return the component of a name."""
        return next(component for component in self.components if component.name == name)


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
