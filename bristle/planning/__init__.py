"""The next tests of a rig: the folder that holds them."""
