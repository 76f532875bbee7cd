"""Control laws at run time: pure functions in the standard library, bundled in every FMU."""
