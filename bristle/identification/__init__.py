"""Parameters from measurements, with uncertainty."""
