"""Machine files and programs: their types, their checks, and their values in SI.

May enter: what reads controller.toml, programs and part programs, and turns them into parameters and steps.
"""
