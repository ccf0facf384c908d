"""The proof of a diagnosis: what its written model leaves of recordings that took no part in it."""
