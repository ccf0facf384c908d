"""What a cycle computes of an axis, compiled: inputs, drive sequence, law, supervision, set points, row.

Pure functions of records and numbers, the same in the daemon and in the batch twin. What they find comes back
as bits and codes; texts, policy and whatever is rare stay in Python, in `axis` and `daemon`.
"""
