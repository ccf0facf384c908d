"""Points as Telegraf writes them go into a real InfluxDB, which answers every query of the dashboard.

InfluxDB is Debian's (1.6.7), whose InfluxQL version 2 speaks too. Lines are made by its vendor's client and
read back by another parser. No package of Debian, PyPI or npm has Telegraf or Grafana: libxml2 evaluates the
paths of telegraf.conf, and the types that Grafana publishes load the dashboard. Ends with 1 where a query
finds nothing or a key is lost.
"""

import argparse
import contextlib
import json
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from free_port import free_tcp_port  # noqa: E402  # where it is
from published_messages import messages  # noqa: E402  # where it is
from telegraf_paths import points  # noqa: E402  # the same

from tests.campaigns.environments import environment  # noqa: E402  # behind those

PACKAGES = (
    "influxdb-client==1.50.0",
    "line-protocol-parser==2.0.1",
    "grafana-foundation-sdk==1769699452!11.5.0",
)
DASHBOARD = ROOT / "deploy" / "history" / "grafana" / "dashboards" / "servo.json"
DATABASE = "servo"
LINES = """
import json, sys
from influxdb_client import Point
from line_protocol_parser import parse_line
for measurement, tags, fields, when in json.load(sys.stdin):
    point = Point.from_dict({"measurement": measurement, "tags": tags, "fields": fields, "time": when})
    line = point.to_line_protocol()
    back = parse_line(line)
    assert (back["measurement"], back["tags"]) == (measurement, tags), line
    assert set(back["fields"]) == {name for name, value in fields.items() if value is not None}, line
    print(line)
"""
LOADED = """
import json, sys
from grafana_foundation_sdk.models.dashboard import Dashboard
from grafana_foundation_sdk.cog.encoder import JSONEncoder
document = json.load(sys.stdin)
again = json.loads(JSONEncoder().encode(Dashboard.from_json(document)))
lost = [f"{name}" for name in document if name not in again and document[name] is not None]
for panel, other in zip(document["panels"], again["panels"], strict=True):
    lost += [f"{panel['title']}: {name}" for name in panel if name not in other]
print(json.dumps({"panels": len(again["panels"]), "lost": lost}))
"""


def asked(address: str, path: str, body: bytes | None = None, **words: str) -> Any:
    """Return InfluxDB's answer. Raises SystemExit with its reason."""
    url = f"{address}{path}?{urllib.parse.urlencode(words)}"
    request = urllib.request.Request(url, body)  # noqa: S310  # the address is ours
    try:
        with urllib.request.urlopen(request, timeout=20.0) as answer:  # noqa: S310  # the same
            text = answer.read()
    except urllib.error.HTTPError as error:
        raise SystemExit(f"{path}: {error.read().decode()}") from None
    return json.loads(text) if text else {}


@contextlib.contextmanager
def influxdb(place: Path) -> Iterator[str]:
    """Run InfluxDB on loopback, with its files in `place`; yields its address."""
    port, backup = free_tcp_port(), free_tcp_port()
    configuration = place / "influxdb.conf"
    configuration.write_text(
        f'reporting-disabled = true\nbind-address = "127.0.0.1:{backup}"\n'
        f'[meta]\ndir = "{place}/meta"\n[data]\ndir = "{place}/data"\nwal-dir = "{place}/wal"\n'
        f'[http]\nbind-address = "127.0.0.1:{port}"\nlog-enabled = false\n',
        encoding="utf-8",
    )
    address = f"http://127.0.0.1:{port}"
    with (place / "influxdb.log").open("wb") as log:
        process = subprocess.Popen(["influxd", "-config", str(configuration)], stdout=log, stderr=log)
    try:
        deadline_s = time.monotonic() + 60.0
        while True:
            try:
                asked(address, "/ping")
                break
            except urllib.error.URLError:
                if process.poll() is not None or time.monotonic() > deadline_s:
                    raise SystemExit((place / "influxdb.log").read_text(encoding="utf-8")) from None
                time.sleep(0.1)
        yield address
    finally:
        process.terminate()
        process.wait(30.0)


def query_of(text: str) -> str:
    """Return a query as Grafana sends it: variable, span and step put in."""
    span = "time >= now() - 3650d"
    return text.replace("$timeFilter", span).replace("$machine", "xy_table").replace("$__interval", "1d")


def found(address: str, query: str) -> int:
    """Return how many values a query finds that are not null."""
    answer = asked(address, "/query", db=DATABASE, q=query_of(query))
    (result,) = answer["results"]
    if "error" in result:
        raise SystemExit(f"{query}: {result['error']}")
    rows = [row for series in result.get("series", []) for row in series["values"]]
    return sum(any(value is not None for value in row[1:]) for row in rows)


def output_of(python: Path, program: str, document: object) -> str:
    """Return what a program prints for a document."""
    done = subprocess.run(
        [str(python), "-c", program],
        input=json.dumps(document),
        text=True,
        check=True,
        stdout=subprocess.PIPE,
    )
    return done.stdout


def trial(python: Path) -> dict[str, Any]:
    """Write one point of each kind, and run every query of the dashboard. Raises SystemExit."""
    written = [point for topic, payload in messages().items() for point in points(topic, payload)]
    lines = output_of(
        python, LINES, [[one.measurement, one.tags, one.fields, one.time or None] for one in written]
    )
    dashboard = json.loads(DASHBOARD.read_text(encoding="utf-8"))
    queries = [target["query"] for panel in dashboard["panels"] for target in panel["targets"]]
    queries += [variable["query"] for variable in dashboard["templating"]["list"]]
    with tempfile.TemporaryDirectory(prefix="servo-history-") as place, influxdb(Path(place)) as address:
        asked(address, "/query", b"", q=f"CREATE DATABASE {DATABASE}")
        asked(address, "/write", lines.encode(), db=DATABASE)
        answers = {query: found(address, query) for query in queries}
    loaded = json.loads(output_of(python, LOADED, dashboard))
    return {
        "points": len(lines.splitlines()),
        "measurements": sorted({one.measurement for one in written}),
        "queries": len(answers),
        "queries without an answer": [query for query, count in answers.items() if count == 0],
        "panels that Grafana's types load": loaded["panels"],
        "lost on the way through them": loaded["lost"],
    }


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/test-history"))
    wanted = parser.parse_args()
    if shutil.which("influxd") is None:
        parser.exit(1, "influxd is not installed: apt-get install influxdb\n")
    seen = trial(environment(wanted.out.resolve() / "environment", PACKAGES) / "python")
    print(json.dumps(seen, indent=1))
    if wanted.json:
        wanted.json.write_text(json.dumps(seen, indent=1) + "\n", encoding="utf-8")
    sys.exit(1 if seen["queries without an answer"] or seen["lost on the way through them"] else 0)


if __name__ == "__main__":
    main()
