"""The report of a recorded run: evaluated once into `content`, drawn as a web page and as a PDF.

It reads only recordings. The files of sections evaluate; only `html_*` and `pdf_*` draw.
"""
