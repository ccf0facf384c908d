"""Put the JSON of several runs of the trial together as docs/blind_families.json, for `make pages`.

python -m tests.campaigns.blind.families.merge out/*.json --engine 17db255

`--training` makes training cases of scored ones: once they have been looked at, they prove nothing any more.
"""

import argparse
import json
from pathlib import Path

from tests.campaigns.blind.families.score import Row
from tests.campaigns.blind.families.seeds import KEPT_OUT

KEPT = Path(__file__).parents[4] / "docs" / "blind_families.json"


def merged(runs: list[Row], engine: str) -> Row:
    """Return one result of all runs' rows, by family and seed.

    Raises:
        ValueError: a case is in two of the runs, sorts of seeds are mixed, or a family is kept out.
    """
    rows = [row for run in runs for row in run["rows"]]
    for family in {*KEPT_OUT} & {row["family"] for row in rows}:
        raise ValueError(f"{family} is kept out: what is merged here is fitted on or published")
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
    parser.add_argument("--json", type=Path, default=KEPT, help="where the whole goes")
    asked = parser.parse_args()
    runs = [json.loads(file.read_text(encoding="utf-8")) for file in asked.runs]
    try:
        content = merged(runs, asked.engine)
    except ValueError as error:
        parser.error(str(error))
    if asked.training:
        content["scored"] = False
    head = json.dumps({**content, "rows": []}).removesuffix("[]}")
    told = ",\n".join(json.dumps(row) for row in content["rows"])
    asked.json.write_text(f"{head}[\n{told}\n]}}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
