"""Make every generated table, page and picture of the documents: `make pages`."""

import argparse

from tests.campaigns.pages import pictures
from tests.campaigns.pages.generated import GENERATED, ROOT


def main() -> None:
    """Run the command line; with `--check` nothing is written, and what differs is an error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--check", action="store_true", help="write nothing; fail where a page is out of date"
    )
    parser.add_argument(
        "--pictures", choices=pictures.TAKES, default="seconds", help="draw those that take no longer"
    )
    asked = parser.parse_args()
    stale = []
    for one in GENERATED:
        file = ROOT / one.page
        before = file.read_text(encoding="utf-8") if file.exists() else ""
        after = one.filled(before)
        if after != before:
            stale.append(one.page)
            if not asked.check:
                file.write_text(after, encoding="utf-8")
    if not asked.check:
        stale += [f"docs/{place}" for place in pictures.draw_all(asked.pictures, ROOT / "docs")]
    if asked.check and stale:
        parser.exit(1, f"out of date: {', '.join(stale)}; run: make pages\n")
    print("\n".join(f"remade: {page}" for page in stale) or "every page is that of its figures")


if __name__ == "__main__":
    main()
