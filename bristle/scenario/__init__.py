"""Scenarios as data: files read, and checked before a step."""
