"""Figures that the project is held to, measured: `python -m benchmarks`."""
