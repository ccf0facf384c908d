"""The G-code reader: text to blocks, words, arcs and paths. Knows no machine file."""
