"""A simulated machine beside the controller: `hil-sim` as a process, and one program run on it."""
