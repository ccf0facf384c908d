"""Tables in Markdown, as the generated parts of the documents have them, and on a terminal."""

from collections.abc import Iterable, Sequence

from rich.markdown import Markdown


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; every row has as many cells as there are heads."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def titled(title: str, table: str) -> Markdown:
    """Return a table in Markdown for a terminal, its title above it."""
    return Markdown(f"**{title}**\n\n{table}")
