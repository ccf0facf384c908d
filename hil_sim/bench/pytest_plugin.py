"""Pytest plugin for HIL tests of any controller: `pytest --hil xy_table`.

A test with the fixture `hil_bench` gets a fresh machine; it is skipped without the option `--hil`.
"""

from collections.abc import Iterator

import pytest

from hil_sim.bench.bench import Bench


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option `--hil`."""
    parser.addoption("--hil", metavar="MACHINE", help="Machine directory, or the name of a shipped machine.")


@pytest.fixture
def hil_bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    """Start the machine of `--hil` for one test, in lockstep; skip the test without the option."""
    machine = request.config.getoption("--hil")
    if machine is None:
        pytest.skip("no machine is named: --hil MACHINE")
    with Bench(machine) as bench:
        yield bench
