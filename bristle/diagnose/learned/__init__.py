"""What no effect of the library is: a curve learned inside the model, with the law refitted."""
