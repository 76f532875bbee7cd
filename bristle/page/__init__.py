"""The local page: a server for one user on one machine, on top of commands and public functions."""
