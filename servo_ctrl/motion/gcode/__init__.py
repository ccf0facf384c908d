"""The G-code reader: text to blocks, words, arcs and paths. It does not depend on the machine file."""
