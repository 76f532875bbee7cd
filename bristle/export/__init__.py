"""A scenario or component for others: as one FMU, and as WebAssembly that a page runs."""
