"""Co-simulation: scenarios as data, checked before a step, and the master that runs them."""
