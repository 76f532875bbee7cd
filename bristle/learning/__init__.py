"""A curve or a formula inside the model where no effect of the library fits."""
