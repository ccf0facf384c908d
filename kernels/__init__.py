"""The basis of every package: the compiler, quantities with units and bounds, records, lean imports.

It contains nothing of the domain and imports only numpy, numba and the standard library.
"""
