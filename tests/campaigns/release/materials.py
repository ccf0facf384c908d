"""The bill of materials of a release as CycloneDX 1.6 JSON, and the requirements with hashes."""

import re
import uuid
from datetime import UTC, datetime
from pathlib import Path

from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import DisjunctiveLicense
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL

from tests.campaigns.release.packages import OURS, Package, canonical

ROOT = Path(__file__).parents[3]
HASHES = ROOT / "constraints-hashes.txt"


def hashes() -> dict[str, tuple[str, tuple[str, ...]]]:
    """Return version and SHA-256 of every file of each pinned package, by canonical name."""
    found = {}
    for entry in HASHES.read_text(encoding="utf-8").replace("\\\n", " ").splitlines():
        if entry.strip():
            head, *rest = entry.split()
            name, _, version = head.partition("==")
            found[canonical(name)] = version, tuple(re.findall(r"sha256:([0-9a-f]{64})", " ".join(rest)))
    return found


def bill(packages: dict[str, Package], wheel_sha256: str, when_s: int) -> str:
    """Return the CycloneDX document; the same for the same packages, wheel and time."""
    components = {
        name: Component(
            type=ComponentType.APPLICATION if name == OURS else ComponentType.LIBRARY,
            name=one.name,
            version=one.version,
            purl=PackageURL("pypi", None, one.name, one.version),
            bom_ref=f"{one.name}@{one.version}",
            licenses=[DisjunctiveLicense(name=one.licence)] if one.licence else [],
            hashes=[HashType(alg=HashAlgorithm.SHA_256, content=wheel_sha256)] if name == OURS else [],
        )
        for name, one in packages.items()
    }
    document = Bom(
        components=[one for name, one in components.items() if name != OURS],
        serial_number=uuid.uuid5(uuid.NAMESPACE_OID, wheel_sha256),
    )
    document.metadata.component = components[OURS]
    document.metadata.timestamp = datetime.fromtimestamp(when_s, UTC)
    for name, one in packages.items():
        document.register_dependency(components[name], [components[need] for need in one.needs])
    return JsonV1Dot6(document).output_as_string(indent=1) + "\n"


def requirements(packages: dict[str, Package], wheel: str, wheel_sha256: str) -> str:
    """Return a file for `pip install --require-hashes --no-deps -r`, the wheel beside it included."""
    pinned = hashes()
    lines = [f"./{wheel} --hash=sha256:{wheel_sha256}"]
    for name in sorted(set(packages) - {OURS}):
        version, digests = pinned[name]
        lines.append(" \\\n    ".join([f"{name}=={version}", *(f"--hash=sha256:{one}" for one in digests)]))
    return "\n".join(lines) + "\n"
