"""The report of a recorded run: evaluated once into `content`, drawn as a web page and as a PDF.

It reads recordings alone. A section's file evaluates; only `html_*` and `pdf_*` draw.
"""
