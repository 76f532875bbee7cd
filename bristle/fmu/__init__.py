"""Components as FMUs: the shared slave, the build, what an FMU says of itself, conformance."""
