"""Files and their configuration, with what is wrong in them; no physics."""
