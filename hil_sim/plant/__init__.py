"""The plant: records of axes, and the kernels that compose the effects into substeps.

Files here name only the effects that form the mechanics (couplings, backlash, sensors); all others join by
their kind.
"""
