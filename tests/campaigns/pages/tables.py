"""Tables of measured figures: `<!-- table: NAME -->` to `<!-- end -->` is made of docs/tables/PAGE.json.

A table there has the `command` that measures it, `made` (when, and how the figures came into the file), and
`rows` of cells, the header first. Change figures in the JSON, then `make pages`. After a command has printed
a table into its page, or where a page gets a new one, put the marks around it and take it over:

    python -m tests.campaigns.pages.tables docs/benchmarks.md --made "2026-11-24, a quiet machine"
"""

import argparse
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "docs" / "tables"
MARKED = re.compile(r"<!-- table: ([a-z0-9-]+) -->\n(.*?)<!-- end -->", re.DOTALL)
ANY_MARKED = re.compile(r"<!-- [^>]+ -->\n.*?<!-- end -->", re.DOTALL)
TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)
NUMBER = re.compile(r"^[-+<>~±]?\d[\d.,]*\s*(?:%|[a-zA-Zµ]{1,4}\b)?")
MEASURED = 0.3
"""Share of the cells below the header that begin with a number, from which on a table is one of figures."""


def source_of(page: str) -> Path:
    """Return the JSON of a page, `docs/x.md` or `README.md`."""
    return FOLDER / f"{Path(page).stem}.json"


def cells(line: str) -> list[str]:
    """Return the cells of a row; a bar within one is written with a backslash."""
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]


def table(rows: list[list[str]]) -> str:
    """Return rows as Markdown, the first as header."""
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "".join(f"| {' | '.join(line)} |\n".replace("|  |", "| |") for line in lines)


def filled(document: str, tables: dict[str, Any]) -> str:
    """Return the document with its marked tables remade.

    Raises:
        ValueError: the document marks a table that the JSON lacks, or the other way round.
    """
    marked = [name for name, _ in MARKED.findall(document)]
    if sorted(marked) != sorted(tables):
        raise ValueError(f"marks {sorted(marked)} and tables {sorted(tables)} are not the same")
    return MARKED.sub(
        lambda found: f"<!-- table: {found[1]} -->\n{table(tables[found[1]]['rows'])}<!-- end -->", document
    )


def taken_over(document: str, before: dict[str, Any], made: str, command: str) -> dict[str, Any]:
    """Return the tables as they stand in the document; what changed or is new is from this command."""
    found = {}
    for name, text in MARKED.findall(document):
        lines = [cells(line) for line in text.splitlines() if line.startswith("|")]
        rows = [lines[0], *lines[2:]]
        old = before.get(name, {"command": command})
        found[name] = (
            old if old.get("rows") == rows else {"command": old["command"], "made": made, "rows": rows}
        )
    return found


def unmarked(document: str) -> Iterator[str]:
    """Yield the headers of tables of figures that stand between no marks."""
    for text in TABLE.findall(ANY_MARKED.sub("", document)):
        lines = text.splitlines()
        body = [cell for line in lines[2:] for cell in cells(line)]
        if body and sum(bool(NUMBER.match(cell.strip("*`"))) for cell in body) >= MEASURED * len(body):
            yield lines[0]


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("page", type=Path, help="take over what stands between the marks of this page")
    parser.add_argument("--made", required=True, help="when and where the figures were made")
    parser.add_argument("--command", default="", help="what makes them, for tables that are new")
    asked = parser.parse_args()
    file = source_of(str(asked.page))
    before = json.loads(file.read_text(encoding="utf-8"))["tables"] if file.exists() else {}
    tables = taken_over(asked.page.read_text(encoding="utf-8"), before, asked.made, asked.command)
    file.parent.mkdir(exist_ok=True)
    file.write_text(dumped(str(asked.page), tables), encoding="utf-8")


def dumped(page: str, tables: dict[str, Any]) -> str:
    """Return the JSON of a page, one row a line."""
    parts = []
    for name, of in tables.items():
        rows = ",\n    ".join(json.dumps(row, ensure_ascii=False) for row in of["rows"])
        head = {key: value for key, value in of.items() if key != "rows"}
        text = json.dumps(head, ensure_ascii=False)[:-1]
        parts.append(f'  {json.dumps(name)}: {text}, "rows": [\n    {rows}\n  ]}}')
    return f'{{"page": {json.dumps(page)}, "tables": {{\n' + ",\n".join(parts) + "\n}}\n"


if __name__ == "__main__":
    main()
