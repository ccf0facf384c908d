"""One axis: its drive's sequence, its supervision, and the reactions to events (`fault_policy`)."""
