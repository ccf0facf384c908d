"""The plant: records of axes, and the kernels that compose the effects into one substep and many.

No effect is named here but those that make up the mechanics (couplings, play, sensors); all others join by
their kind.
"""
