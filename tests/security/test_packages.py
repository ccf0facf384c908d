"""Installed packages are pinned, come from a registry and fit together; advisories on request."""

import http.server
import json
import os
import subprocess
import sys
import threading
import tomllib
from collections.abc import Iterator
from importlib.metadata import Distribution, distributions
from pathlib import Path
from typing import Any

import pytest
from advisories import ACCEPTED, AuditError, advisories, canonical, pinned

ROOT = Path(__file__).parents[2]
OURS, TOOLS = "servo-ctrl", {"pip", "setuptools", "wheel"}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def installed() -> dict[str, Distribution]:
    """What is in this environment and not from the system, by canonical name."""
    inside = [place for place in sys.path if place.startswith(sys.prefix)]
    return {canonical(found.metadata["Name"]): found for found in distributions(path=inside)}


def test_every_installed_package_is_pinned_at_its_version() -> None:
    wanted = {canonical(name): version for name, version in pinned().items()}
    found = {name: one.version for name, one in installed().items() if name not in {OURS, *TOOLS}}
    assert len(found) > 50
    assert {name: version for name, version in found.items() if wanted.get(name) != version} == {}


def test_every_dependency_is_pinned_at_the_version_of_the_constraints() -> None:
    wanted = {canonical(name): version for name, version in pinned().items()}
    lists = [PROJECT["dependencies"], *PROJECT["optional-dependencies"].values()]
    for text in (text for one in lists for text in one):
        name, separator, version = text.partition(";")[0].partition("==")  # without its marker
        assert separator, f"{text} is not pinned"
        assert wanted[canonical(name)] == version


def test_nothing_was_installed_from_elsewhere_than_a_registry() -> None:
    direct = {name for name, one in installed().items() if one.read_text("direct_url.json") is not None}
    assert direct == {OURS}


def test_installed_packages_fit_together() -> None:
    checked = subprocess.run(
        [sys.executable, "-m", "pip", "check"], capture_output=True, text=True, check=False, timeout=60
    )
    assert checked.returncode == 0, checked.stdout


@pytest.mark.parametrize(
    "line", ["numpy", "numpy>=2", "numpy==2.*", "numpy @ https://example", "-r more.txt"]
)
def test_a_line_that_pins_nothing_is_refused(line: str, tmp_path: Path) -> None:
    file = tmp_path / "constraints.txt"
    file.write_text(f"a==1\n{line}\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"constraints\.txt:2"):
        pinned(file)


class Database(http.server.BaseHTTPRequestHandler):
    """Knows one advisory."""

    answer: Any = None

    def do_POST(self) -> None:
        queries = json.loads(self.rfile.read(int(self.headers["content-length"])))["queries"]
        results = [
            {"vulns": [{"id": "PYSEC-1"}, {"id": "GHSA-2"}]} if query["package"]["name"] == "bad-one" else {}
            for query in queries
        ]
        content = json.dumps({"results": results} if self.answer is None else self.answer).encode()
        self.send_response(200)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_arguments: Any) -> None:
        """Silent."""


@pytest.fixture
def service() -> Iterator[str]:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Database) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()
        thread.join()


def test_an_advisory_is_found_and_an_accepted_one_left_out(
    service: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    packages = {"good": "1.0", "Bad_One": "2.0"}
    assert advisories(packages, service) == {"Bad_One 2.0": ["PYSEC-1", "GHSA-2"]}
    monkeypatch.setitem(ACCEPTED, "GHSA-2", "of another system")
    assert advisories(packages, service) == {"Bad_One 2.0": ["PYSEC-1"]}


@pytest.mark.parametrize("answer", [{}, [], {"results": []}, {"results": None}])
def test_an_unexpected_answer_is_an_audit_error(
    service: str, answer: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Database, "answer", answer)
    with pytest.raises(AuditError, match="answers something else"):
        advisories({"good": "1.0"}, service)


def test_an_unreachable_database_is_an_audit_error() -> None:
    with pytest.raises(AuditError, match="cannot be reached"):
        advisories({"good": "1.0"}, "http://127.0.0.1:9/")


@pytest.mark.skipif(
    os.environ.get("AUDIT") != "online",
    reason="advisories were not asked for: `make audit`, or AUDIT=online make test, with a network",
)
def test_no_advisory_is_known_for_what_is_pinned() -> None:
    assert advisories(pinned()) == {}
