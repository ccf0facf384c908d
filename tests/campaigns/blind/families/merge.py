"""Put the JSON of several runs of the trial together as docs/blind_families.json, for `make pages`.

python -m tests.campaigns.blind.families.merge out/*.json --engine 17db255

`--training` makes training cases of scored ones: once they have been looked at, they prove nothing any more.
`--kept-out` is for families on which nothing is fitted: they have a file and a table of their own.
"""

import argparse
import json
from pathlib import Path

from tests.campaigns.blind.families.score import Row
from tests.campaigns.blind.families.seeds import KEPT_OUT

DOCS = Path(__file__).parents[4] / "docs"


def merged(runs: list[Row], engine: str, *, kept_out: bool = False) -> Row:
    """Return one result of all runs' rows, by family and seed; of families that are `kept_out`, or none.

    Raises:
        ValueError: a case is in two of the runs, sorts of seeds are mixed, or a family is of the other kind.
    """
    rows = [row for run in runs for row in run["rows"]]
    for family in {row["family"] for row in rows if (row["family"] in KEPT_OUT) != kept_out}:
        other = "it is fitted on" if kept_out else "nothing is fitted on it"
        raise ValueError(f"{family} does not belong here: {other}, see --kept-out")
    cases = [(row["family"], row["seed"]) for row in rows]
    if len({*cases}) != len(cases):
        raise ValueError("a case is in two of the files: give each once")
    if len({run["scored"] for run in runs}) != 1:
        raise ValueError("scored and training seeds are mixed: merge them apart")
    rows.sort(key=lambda row: (row["family"], row["seed"]))
    return {"scored": runs[0]["scored"], "engine": engine, "rows": rows}


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=Path, nargs="+", help="JSON files of the trial")
    parser.add_argument("--engine", required=True, help="commit of the sources that were scored")
    parser.add_argument("--training", action="store_true", help="the cases are for training from now on")
    parser.add_argument("--kept-out", action="store_true", help="the families are those kept out of all fits")
    parser.add_argument("--json", type=Path, help="where the whole goes, if not docs/blind_families*.json")
    asked = parser.parse_args()
    runs = [json.loads(file.read_text(encoding="utf-8")) for file in asked.runs]
    try:
        content = merged(runs, asked.engine, kept_out=asked.kept_out)
    except ValueError as error:
        parser.error(str(error))
    if asked.training:
        content["scored"] = False
    head = json.dumps({**content, "rows": []}).removesuffix("[]}")
    told = ",\n".join(json.dumps(row) for row in content["rows"])
    end = "_kept_out" if asked.kept_out else ""
    file = asked.json or DOCS / f"blind_families{end}.json"
    file.write_text(f"{head}[\n{told}\n]}}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
