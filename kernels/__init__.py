"""What every package stands on: the compiler, quantities with units and bounds, records, lean imports.

Domain-free, and a leaf: it imports numpy, numba and the standard library, and no package of ours.
"""
