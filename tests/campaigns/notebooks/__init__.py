"""The notebooks of docs/notebooks, executed cell by cell: `make notebooks` (needs the publishers' data)."""
