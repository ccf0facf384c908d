"""Learning over the bus: monitoring of production, learning runs, and the compensations in use."""
