"""Are there advisories for what constraints.txt pins? Asks the OSV database, in one request: `make audit`.

It shows another host what is installed here, and its answer changes from day to day. So `make test` does not
ask by itself; with AUDIT=online it does.
"""

import http.client
import json
import re
import sys
import urllib.error
import urllib.request
from pathlib import Path

SERVICE = "https://api.osv.dev/v1/querybatch"
LIMIT_S = 20.0
LARGEST_ANSWER = 16 << 20
CONSTRAINTS = Path(__file__).parents[2] / "constraints.txt"
ACCEPTED: dict[str, str] = {}
"""Accepted advisories by id, with the reason why they do not apply."""


class AuditError(Exception):
    """The database does not answer, or its answer lacks a documented field."""


def pinned(path: Path = CONSTRAINTS) -> dict[str, str]:
    """Version by name, both as they are written; raises ValueError for another line than `name==version`."""
    found: dict[str, str] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        match = re.fullmatch(r"([A-Za-z0-9][A-Za-z0-9._-]*)==([0-9][0-9A-Za-z.+!-]*)", text)
        if match is None or canonical(match[1]) in map(canonical, found):
            raise ValueError(f"{path.name}:{number}: {text!r} is not a name==version, or is there twice")
        found[match[1]] = match[2]
    return found


def canonical(name: str) -> str:
    """Return the name in the form in which names of packages are compared."""
    return re.sub(r"[-_.]+", "-", name).lower()


def advisories(packages: dict[str, str], service: str = SERVICE) -> dict[str, list[str]]:
    """Return ids of advisories by "name version", without accepted ones. Raises AuditError."""
    queries = [
        {"package": {"name": canonical(name), "ecosystem": "PyPI"}, "version": version}
        for name, version in packages.items()
    ]
    request = urllib.request.Request(  # noqa: S310  # the address is ours
        service, json.dumps({"queries": queries}).encode(), {"Content-Type": "application/json"}
    )
    try:
        with urllib.request.urlopen(request, timeout=LIMIT_S) as answer:  # noqa: S310  # the same
            results = json.loads(answer.read(LARGEST_ANSWER))["results"]
    except (OSError, urllib.error.URLError, http.client.HTTPException) as error:
        raise AuditError(f"{service} cannot be reached: {error}") from None
    except (ValueError, KeyError, TypeError) as error:
        raise AuditError(f"{service} answers something else: {error!r}") from None
    if not isinstance(results, list) or len(results) != len(queries):
        raise AuditError(f"{service} answers something else: not one result for each package")
    found = {}
    for (name, version), result in zip(packages.items(), results, strict=True):
        ids = [entry["id"] for entry in result.get("vulns", [])]
        if left := [number for number in ids if number not in ACCEPTED]:
            found[f"{name} {version}"] = left
    return found


def main() -> int:
    """Return the exit status: 0 without advisories, 1 with some, 2 if the request failed."""
    packages = pinned()
    try:
        found = advisories(packages)
    except AuditError as error:
        print(f"not audited: {error}", file=sys.stderr)
        return 2
    for package, ids in found.items():
        print(f"{package}: {', '.join(ids)}")
    print(f"{len(packages)} packages, {len(found)} with advisories")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
