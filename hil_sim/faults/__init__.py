"""faults: what breaks under way. One fault, one file; they begin at an instant of simulated time and stay."""
