"""Shirazi et al. (2012) reproduced: figures, tables, claims, and the reference controllers."""
