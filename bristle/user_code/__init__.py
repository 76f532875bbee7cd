"""Rules that every effect obeys, and whether numba compiles an effect of a user."""
