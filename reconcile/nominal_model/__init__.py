"""The model that is given: its file, the axes it describes, and its effects as terms of the catalogue."""
