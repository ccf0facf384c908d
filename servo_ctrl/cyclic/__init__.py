"""What a cycle computes of an axis, compiled: inputs, drive sequence, law, supervision, set points, row.

Pure functions of records and numbers, for the daemon; the batch twin shares the law. What they find comes
back as bits and codes; texts, policy and whatever is rare stay in Python, in `axis` and `daemon`.
"""
