"""Where simulation and measurement meet: a study's model as an FMU, an FMU against measurements."""
