"""Co-simulation: scenarios as data, checked before the first step, and the master that runs them."""
