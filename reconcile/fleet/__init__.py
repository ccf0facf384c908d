"""`reconcile fleet`: diagnoses every axis of many machines on many cores, and shows common missing physics.

From recordings as partitioned Parquet (`dataset`) and a model for each axis (`models`) to a table with a row
for each axis (`rows`, `store`) and a page (`page`). Only `dask_workers` uses dask, only `dataset` uses
fsspec.
"""
