"""The laws of physics, each written once, in the standard library alone.

FMUs carry this package and run it as it is; `bristle.engine` runs the same source through
numba. So laws are pure functions of floats: `math`, arithmetic and `if`, with lists or arrays
only where a caller passes them in to be filled.
"""
