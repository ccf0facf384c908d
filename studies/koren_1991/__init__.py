"""Cross-coupled contour control (Koren and Lo 1991) on the X-Y table."""
