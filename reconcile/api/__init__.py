"""What other programs call: `reconcile.diagnose(frames, model)` and its typed result."""
