"""Compensations that add to the commands of the cascade: one compensation, one file.

A file holds the law, its `Params` and `State`, the parameters that switch it off (`NEUTRAL`), and `SECTION`,
its keys in the machine file. `control.tick` calls each where it acts; configuration, records, tables of the
documentation and tests are derived.
"""
