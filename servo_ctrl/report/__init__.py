"""The report of a recorded run: what it holds, evaluated once, drawn as a web page and as a PDF."""
