"""Build a release of the committed files: wheel, sdist, site, bill of materials, requirements with hashes.

Each is built twice from two copies and must have the same bytes; the sdist must build the wheel; every
licence must be allowed. Ends with 1 and what is wrong otherwise.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from tests.campaigns.release.materials import ROOT, bill, requirements
from tests.campaigns.release.packages import brought, refused


def committed_s() -> int:
    """Return the time of the last commit, which stands for that of the build."""
    shown = subprocess.run(
        ["git", "log", "-1", "--format=%ct"], cwd=ROOT, check=True, capture_output=True, text=True
    )
    return int(shown.stdout)


def copy_of_commit(place: Path) -> Path:
    """Return a directory below `place` with the committed files."""
    source = place / "source"
    archive = place / "source.tar"
    subprocess.run(["git", "archive", "-o", str(archive), "HEAD"], cwd=ROOT, check=True)
    with tarfile.open(archive) as packed:
        packed.extractall(source, filter="data")
    return source


def build(source: Path, out: Path, when_s: int, *, site: bool) -> dict[str, bytes]:
    """Return the built files by name."""
    environment = {**os.environ, "SOURCE_DATE_EPOCH": str(when_s), "NO_MKDOCS_2_WARNING": "1"}
    out.mkdir(parents=True)
    for kind in ("wheel", "sdist"):
        command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(out)]
        subprocess.run(command, cwd=source, env=environment, check=True, stdout=subprocess.DEVNULL)
    if site:
        pages = out / "site"
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(pages)]
        subprocess.run(command, cwd=source, env=environment, check=True, stderr=subprocess.DEVNULL)
        pack(pages, out / "site.tar", when_s)
    return {path.name: path.read_bytes() for path in sorted(out.iterdir()) if path.is_file()}


def pack(folder: Path, archive: Path, when_s: int) -> None:
    """Pack a folder so that equal files give equal bytes."""

    def plain(entry: tarfile.TarInfo) -> tarfile.TarInfo:
        entry.mtime, entry.uid, entry.gid, entry.uname, entry.gname = when_s, 0, 0, "", ""
        return entry

    with tarfile.open(archive, "w") as packed:
        for path in sorted(folder.rglob("*")):
            if path.suffix != ".gz":  # the site map once more, with a time in its header
                packed.add(path, f"site/{path.relative_to(folder)}", recursive=False, filter=plain)


def released(out: Path, *, site: bool = True) -> list[str]:
    """Write the release to `out`; return what is wrong with it."""
    when_s = committed_s()
    with tempfile.TemporaryDirectory(prefix="servo-release-") as name:
        places = [Path(name) / number for number in ("one", "two")]
        for place in places:
            place.mkdir()
        one, two = (build(copy_of_commit(place), place / "out", when_s, site=site) for place in places)
        wheel, sdist = (next(file for file in one if file.endswith(end)) for end in (".whl", ".tar.gz"))
        with tarfile.open(places[0] / "out" / sdist) as packed:
            packed.extractall(places[0] / "sdist", filter="data")
        (unpacked,) = (places[0] / "sdist").iterdir()
        again = build(unpacked, places[0] / "again", when_s, site=False)
    wrong = [f"{file} has other bytes when it is built again" for file in one if one[file] != two[file]]
    if again[wheel] != one[wheel]:
        wrong.append(f"{sdist} builds another {wheel}")
    packages = brought()
    wrong += [
        f"the licence of {name} is not allowed: {licence}" for name, licence in refused(packages).items()
    ]
    digest = hashlib.sha256(one[wheel]).hexdigest()
    texts = {
        "sbom.cdx.json": bill(packages, digest, when_s),
        "requirements.txt": requirements(packages, wheel, digest),
    }
    out.mkdir(parents=True, exist_ok=True)
    contents = one | {file: text.encode() for file, text in texts.items()}
    sums = "".join(f"{hashlib.sha256(content).hexdigest()}  {file}\n" for file, content in contents.items())
    for file, content in (contents | {"SHA256SUMS": sums.encode()}).items():
        (out / file).write_bytes(content)
    return wrong


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/release"))
    asked = parser.parse_args()
    wrong = released(asked.out)
    print("\n".join(f"{path.stat().st_size:>10}  {path}" for path in sorted(asked.out.iterdir())))
    if wrong:
        parser.exit(1, "\n".join(wrong) + "\n")
    print(f"{len(brought())} packages, every licence allowed; built twice, the same bytes")


if __name__ == "__main__":
    main()
