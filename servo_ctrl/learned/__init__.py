"""The versioned store of learned results, which a crash neither loses nor leaves partially written.

May enter: schemas, files and journals of learned results, and the checks that a result fits its machine.
"""
