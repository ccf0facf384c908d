"""Where a residual is: coordinates of the motion and spectral lines, ranked by the share that they explain.

Shares are cross-validated. Only functions of residuals and motion enter; no effect is named here.
"""
