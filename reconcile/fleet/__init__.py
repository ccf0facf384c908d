"""`reconcile fleet`: diagnose every axis of many machines on many cores, and show what the machines share.

From recordings as partitioned Parquet (`dataset`) and a model for each axis (`models`) to a table with a row
for each axis (`rows`, `store`) and a page (`page`). Only `cluster` uses dask, only `dataset` uses fsspec.
"""
