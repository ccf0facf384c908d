"""From recordings to linear algebra: filtered columns, normal equations by block, residuals and their noise.

Terms of the catalogue enter as columns. No decision on an effect is made here.
"""
