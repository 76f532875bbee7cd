"""Optimisation of what a scenario leaves open, by compiled runs."""

from __future__ import annotations

from .passive import Motion, Optimum, Passive, optimise_passive

__all__ = ["Motion", "Optimum", "Passive", "optimise_passive"]
