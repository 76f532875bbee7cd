"""Components as FMUs without Python: their functions compiled, with one shim in C for all."""
