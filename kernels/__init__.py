"""What compiled functions of every package stand on: the compiler, quantities with units and bounds, records.

Domain-free, and a leaf: it imports numpy, numba and the standard library, and no package of ours.
"""
