"""The Motion page: program files, the form of their steps, their check and path, and the run."""
