"""The model update: identified effects as sections of a plant file that `hil-sim run` can run."""
