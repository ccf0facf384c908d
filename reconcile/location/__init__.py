"""Where a residual is: coordinates of the motion and spectral lines, ranked by cross-validated share.

Only functions of residuals and motion enter; no effect is named here.
"""
