"""The fluid thins as it is warmer: the temperature of each run is measured."""

from math import exp

from ..effect import Effect
from ..parameter import Parameter


def warmed(share, T, T_0):
    """Return what a force is at a temperature T by what it is at T_0 [degC], `share` per kelvin."""
    return exp(-min(max(share * (T - T_0), -3.0), 3.0))


def per_kelvin(share):
    """Return in words what a force does with each kelvin."""
    return f"{'falls' if share >= 0.0 else 'rises'} by {100.0 * abs(share):.2g} %"


class MeasuredTemperature(Effect):
    """Measured temperature: the force changes with the temperature of the run.

        viscous factor = exp(-c_viscous (T - T_0)),   yield factor = exp(-c_yield (T - T_0))

    T is the run's temperature as it was measured, T_0 the mean of the training runs, at which the
    law's own values hold. Leaves out what changes within a run (see temperature).
    """

    name = "measured_temperature"
    sites = ("damper",)
    passive = True
    zero_at_rest = True
    source = (
        "Batterbee & Sims (2009), J. Intell. Mater. Syst. Struct. 20(3), 297-309: viscosity and "
        "yield stress against temperature"
    )
    expect = "too much predicted force in warm runs, too little in cold ones"
    amount = "c_viscous"
    family = "by_temperature"
    parameters = {
        "c_viscous": Parameter(0.01, "1/K", (-0.1, 0.1), "fall of the viscous part per kelvin"),
        "c_yield": Parameter(0.005, "1/K", (-0.1, 0.1), "fall of the yield part per kelvin"),
        "T": Parameter(30.0, "degC", (-100.0, 300.0), "temperature of the run"),
        "T_0": Parameter(20.0, "degC", (-100.0, 300.0), "temperature of the law's own values"),
    }
    assumed = ("T", "T_0")
    labels = {"T": "temperature"}
    label_means = {"T_0": "temperature"}
    label_span = 2.0  # K; within less, any drift from run to run would look like it

    @staticmethod
    def yield_factor(q, z, p):
        return warmed(p.c_yield, p.T, p.T_0)

    @staticmethod
    def viscous_factor(q, z, p):
        return warmed(p.c_viscous, p.T, p.T_0)

    @staticmethod
    def in_words(p):
        viscous, solid = p.c_viscous, p.c_yield
        if abs(viscous - solid) < 0.1 * max(abs(viscous), abs(solid)):
            what = f"the force {per_kelvin(0.5 * (viscous + solid))}"
        else:
            what = f"the viscous force {per_kelvin(viscous)}, the yield force {per_kelvin(solid)}"
        return f"With each kelvin above {p.T_0:.3g} °C {what}."
