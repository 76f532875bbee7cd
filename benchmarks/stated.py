"""The error that a run states of its coupling, against the true one, on loops drawn at random."""
