"""The control law of one axis: pure functions of one tick, its loops and compensations. No clock, no I/O."""
