"""A controller that is trained on many ground motions by descent through its closed loop."""
