"""Where the residual of a model lives, in units of the noise, and what an engineer would say."""
