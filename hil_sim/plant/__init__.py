"""The plant: records of axes, and the kernels that compose the effects into substeps.

Files here name only the effects that form the mechanics (couplings, backlash, sensors); the others take part
by their kind. Only records and compiled functions may enter.
"""
