"""Checks of measured data: findings about channels, motion and runs, before anything is fitted."""
