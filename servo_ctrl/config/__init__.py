"""Machine files and programs: their types, their checks, and their values in SI units.

May enter: code that reads controller.toml, programs and part programs and converts them to parameters and
steps.
"""
