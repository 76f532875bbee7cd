"""Plots of plain arrays, and the style that all figures share; matplotlib comes on first use."""
