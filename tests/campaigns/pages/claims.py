"""docs/claims.md: what the documents claim, and the command and file that show it, from docs/claims.toml."""

from collections.abc import Mapping
from typing import Any, NamedTuple

HOW = {
    "test": "the gate fails where it is not so",
    "json": "figures committed as JSON; the table is made from them",
    "run": "figures of one run, copied by hand; the command makes such figures anew, its JSON is not kept",
    "words": "by argument or source; no command shows it",
}
"""How strong a showing is, and what it means."""
HEAD = """# What is claimed, and what shows it

Made by `make pages` from `docs/claims.toml`; do not edit. Of each page and the README: what it claims, and
the command and file that show it. A test holds that each file and each test named here is there, that each
command exists, and that no page is left out.

{legend}

{counts}
"""


class Claim(NamedTuple):
    """A claim of a page."""

    page: str
    claim: str
    how: str
    command: str
    files: tuple[str, ...]
    """From the root of the project; `file::test` names a test."""


def read(listed: Mapping[str, Any]) -> list[Claim]:
    """Return the claims of a parsed claims.toml, in its order.

    Raises:
        ValueError: a claim is shown in a way that `HOW` does not have.
    """
    found = []
    for page, claims in listed.items():
        for one in claims:
            if one["how"] not in HOW:
                raise ValueError(f"{page}: how = {one['how']!r}: write one of {', '.join(HOW)}")
            claim = Claim(page, one["claim"], one["how"], one.get("command", ""), tuple(one.get("files", ())))
            if not claim.files and not claim.command:
                raise ValueError(f"{page}: {claim.claim!r}: name a command or a file that shows it")
            found.append(claim)
    return found


def page(claims: list[Claim]) -> str:
    """Return the page as Markdown."""
    legend = "\n".join(f"- **{how}**: {meaning}." for how, meaning in HOW.items())
    counted = {how: sum(one.how == how for one in claims) for how in HOW}
    counts = (
        f"{len(claims)} claims: " + ", ".join(f"{count} by {how}" for how, count in counted.items()) + "."
    )
    lines = [HEAD.format(legend=legend, counts=counts)]
    for name in dict.fromkeys(one.page for one in claims):
        link = f"[{name}]({name.removeprefix('docs/')})" if name.startswith("docs/") else name
        lines += [f"## {link}", "", "| claim | shown by | command | files |", "| --- | --- | --- | --- |"]
        lines += [_row(one) for one in claims if one.page == name]
        lines.append("")
    return "\n".join(lines)


def _row(one: Claim) -> str:
    command = f"`{one.command}`" if one.command else ""
    return f"| {one.claim} | {one.how} | {command} | {', '.join(f'`{file}`' for file in one.files)} |"
