"""The Python interface: `reconcile.diagnose(frames, model)` and its typed result."""
