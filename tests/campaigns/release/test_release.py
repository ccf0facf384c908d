"""A release names what it is made of: licences, a bill of materials, hashes. `make release` builds it."""

import json

import pytest
from advisories import pinned

from tests.campaigns.release.materials import bill, hashes, requirements
from tests.campaigns.release.packages import OURS, Package, allowed, brought, canonical, refused

SHA256 = "ab" * 32


@pytest.fixture(scope="module")
def packages() -> dict[str, Package]:
    return brought()


def test_all_that_a_user_gets_may_be_given_to_him(packages: dict[str, Package]) -> None:
    assert {"numpy", "markupsafe", "nicegui", "distributed", "asammdf"} <= set(packages)
    assert not {"mypy", "pytest", "mkdocs"} & set(packages)
    assert refused(packages) == {}


@pytest.mark.parametrize(
    ("licence", "good"),
    [
        ("MIT", True),
        ("MPL-2.0 AND (Apache-2.0 OR MIT)", True),
        ("GPL-3.0-only OR BSD-3-Clause", True),
        ("GPL-3.0-only", False),
        ("MIT AND LGPL-3.0", False),
        ("Proprietary", False),
        ("", False),
    ],
)
def test_everything_that_is_not_allowed_is_refused(licence: str, good: bool) -> None:
    assert allowed(licence) is good
    assert bool(refused({"new": Package("new", "1", licence, ())})) is not good


def test_the_bill_of_materials_has_every_package_and_is_the_same_again(packages: dict[str, Package]) -> None:
    text = bill(packages, SHA256, 1_700_000_000)
    document = json.loads(text)
    assert (document["bomFormat"], document["specVersion"]) == ("CycloneDX", "1.6")
    assert document["metadata"]["component"]["hashes"] == [{"alg": "SHA-256", "content": SHA256}]
    assert {one["name"] for one in document["components"]} == set(packages) - {OURS}
    needs = {one["ref"].split("@")[0]: one.get("dependsOn", []) for one in document["dependencies"]}
    assert any(one.startswith("numpy@") for one in needs[OURS])
    assert text == bill(packages, SHA256, 1_700_000_000)


def test_every_pinned_package_has_hashes_of_the_same_version(packages: dict[str, Package]) -> None:
    known = hashes()
    wanted = {canonical(name): version for name, version in pinned().items()}
    assert {name: version for name, (version, _) in known.items()} == wanted, "run: make hashes"
    assert all(digests for _, digests in known.values())
    text = requirements(packages, "ours.whl", SHA256)
    assert text.startswith(f"./ours.whl --hash=sha256:{SHA256}\n")
    assert text.count("==") == len(packages) - 1
