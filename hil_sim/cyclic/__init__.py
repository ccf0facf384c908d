"""What drives and scales do in every cycle, compiled: set points to the plant, its readings, PDOs.

May enter: pure kernels over records. What happens seldom is Python, in `drive`, `scale` and `node`.
"""
