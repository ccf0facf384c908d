"""Learning over the bus: monitoring of production, learning runs, and the compensation that is in use."""
