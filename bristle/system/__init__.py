"""Scenarios and SSP packages: read, checked, completed, written."""
