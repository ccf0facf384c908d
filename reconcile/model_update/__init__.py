"""The written model: findings as sections of a plant file that `hil-sim run` takes."""
