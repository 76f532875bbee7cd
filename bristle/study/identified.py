"""What an identification of a study's model found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import StudyError
from ..identification.error import ForceError
from ..identification.error_table import LawError
from ..identification.fit import Fit
from ..identification.problem import Problem, uncommanded
from ..identification.rig import DAMPER
from ..identification.rig_fit import RigErrors, SiteModel
from ..model.model import Model
from ..physics.forms import split_form
from ..view import Viewable
from .forms import FormError, finite, form_of
from .history import Step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..diagnosis.law_trials import LawTrial


def is_identified(model: Model) -> bool:
    """Return whether a value of a model comes from an identification."""
    return any(value.origin == "identified" for value in model.facts.values())


@dataclass(frozen=True, repr=False)
class Identified(Viewable):
    """What an identification found; `bristle.identify` returns it, and a notebook shows it.

    Attributes
    ----------
    model : Model
        The model with the values found; `model.values` are those in SI.
    fit : Fit
        Values and standard deviations in SI.
    errors_before, errors : RigErrors
        Errors of the model before and of this one; None before a first fit, whose start is no
        model of anybody.
    cutoff : float
        Low-pass [Hz] of those among them that are low-passed.
    table : list of LawError
        Errors of the laws, where they were compared.
    notes : tuple of str
        What to know.
    step : Step or None
        The history's new step, None where nothing was written.
    forms : tuple of FormError
        Errors of the forms of the command, where several were asked for.
    laws : tuple of LawTrial
        How every law does, the best on held-out runs first, where all were asked for.
    at : SiteModel
        The site that a picture shows, with the part of the model that predicts its runs.

    Examples
    --------
    >>> import bristle, numpy as np
    >>> t = np.arange(0.0, 8.0, 0.004)  # s
    >>> v = 72e-3 * np.cos(9.0 * t)  # m/s
    >>> noise = np.random.default_rng(1).normal(0.0, 0.05, t.size)
    >>> run = {"time": t, "velocity": v, "force": 5.0 * np.sign(v) + 90.0 * v + noise}  # s, m/s, N
    >>> found = bristle.identify(run, "bingham_standard")
    >>> found.model.law, found.unidentified
    ('bingham_standard', ('f_v', 'c_v'))
    """

    fit: Fit
    table: list[LawError]
    cutoff: float
    errors_before: RigErrors | None
    errors: RigErrors
    notes: tuple[str, ...]
    step: Step | None
    at: SiteModel
    forms: tuple[FormError, ...] = ()
    laws: tuple[LawTrial, ...] = ()

    @property
    def model(self) -> Model:
        """The model with the values found."""
        return self.fit.model

    @property
    def before(self) -> dict[str, float]:
        """The numbers of `errors_before`, such as "z_holdout"; none before a first fit."""
        return self.errors_before.numbers if self.errors_before is not None else {}

    @property
    def after(self) -> dict[str, float]:
        """The numbers of `errors`, such as "z_holdout" and "error_holdout" [N]."""
        return self.errors.numbers

    @property
    def error(self) -> ForceError:
        """The error on held-out runs; on training runs where none is held out."""
        return self.errors.force.get("holdout", self.errors.force["train"])

    @property
    def train(self) -> Problem:
        """The runs at that site that the model was fitted to."""
        return self.at.site.train

    @property
    def holdout(self) -> Problem | None:
        """The runs at that site that the model was judged on, None where none is held out."""
        return self.at.site.holdout

    @property
    def z(self) -> float:
        """z on held-out runs; on training runs where none is held out."""
        return self.after.get("z_holdout", self.after["z_train"])

    def for_history(self) -> tuple[dict[str, float], dict[str, float]]:
        """Return the errors before and after with the low-pass of the `rms_` ones [Hz], for a step.

        None before where that model was not fitted.
        """
        own = {"cut_off": self.cutoff}
        before, after = (
            {name: value for name, value in errors.items() if value == value}
            for errors in (self.before, self.after)
        )
        return {**before, **own} if before else {}, {**after, **own}

    @property
    def idle(self) -> tuple[str, ...]:
        """Names of the parameters of a command, where nothing commands the damper: none is told."""
        at_damper = self.at.site.name == DAMPER
        return self.model.law_class.driven() if at_damper and uncommanded(self.train) else ()

    @property
    def unidentified(self) -> tuple[str, ...]:
        """Names of the parameters that the data do not identify."""
        return tuple(name for name in self.fit.unidentified if name not in self.idle)

    def plot_budget(self) -> Figure:
        """Return the figure of the force budget: what the law's parts and the effects make of it.

        Raises
        ------
        StudyError
            If the site that is shown is no damper.
        """
        from .budget_picture import draw_budget

        page = draw_budget(self.holdout or self.train, self.at.model)
        if page is None:
            raise StudyError(f"{self.at.site.name}: only a damper has a force budget.")
        return page.figure

    def as_dict(self) -> dict[str, Any]:
        """Return what json can hold."""
        rows = {row["name"]: row for row in self.parameters()}
        laws: dict[str, Any] = {}
        if self.laws:
            from ..diagnosis.law_choice import rows_of  # takes long: most identify one law

            laws["laws"] = rows_of(self.laws)
        return {
            "schema": 1,
            "law": split_form(self.model.law)[0],
            "command": form_of(self.model),
            "command_knots": list(split_form(self.model.law)[2]),
            "effects": list(self.model.effects),
            "parameters": {
                name: {key: row[key] for key in row if key != "name"} for name, row in rows.items()
            },
            "unidentified": list(self.unidentified),
            "starts": self.fit.starts,
            "agreed": self.fit.agreed,
            "cut_off": self.cutoff,
            "before": finite(self.before),
            "after": finite(self.after),
            "noise_known": self.train.noise_known,
            "error": {role: one.as_dict() for role, one in self.errors.force.items()},
            "error_by_site": {
                role: {site: one.as_dict() for site, one in sites.items()}
                for role, sites in self.errors.at.items()
            },
            "table": [row.as_dict() for row in self.table],
            "forms": [row.as_dict() for row in self.forms],
            **laws,
            "notes": list(self.notes),
            "step": self.step.number if self.step else None,
        }

    def parameters(self) -> list[dict[str, Any]]:
        """Return one row per parameter: name, value, unit, half of its 95 % interval, how."""
        rows = []
        told = {n: value for n, value in self.model.written().items() if n not in self.idle}
        for name, value in told.items():
            if name in self.fit.unidentified:
                how = "not identified"
            elif name in self.fit.std:
                how = "identified"
            else:
                how = "held"
            half = 1.96 * value.std if value.std is not None and how == "identified" else None
            rows.append(
                {
                    "name": name, "value": value.value, "unit": value.unit, "interval95": half,
                    "how": how,
                }
            )  # fmt: skip
        return rows
