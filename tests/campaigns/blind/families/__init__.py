"""Families of concealed cases, each a machine of its own, written from the literature alone."""
