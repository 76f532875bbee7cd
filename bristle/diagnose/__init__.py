"""Where and how the model fails, and which effect explains it."""
