"""A simulated machine beside the controller: hub and `hil-sim` as processes, and one program run on it."""
