"""The Friction page: indicators of the reversals, the learning run, and the learned versions."""
