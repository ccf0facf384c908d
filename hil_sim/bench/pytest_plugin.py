"""HIL tests of one's own controller: `pytest --hil xy_table`.

A test that takes `hil_bench` gets a fresh machine; it is skipped where no machine is named.
"""

from collections.abc import Iterator

import pytest

from hil_sim.bench.bench import Bench


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--hil`."""
    parser.addoption("--hil", metavar="MACHINE", help="Machine directory, or the name of a shipped machine.")


@pytest.fixture
def hil_bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    """Serve the bus of the machine of `--hil` during a test, in lockstep."""
    machine = request.config.getoption("--hil")
    if machine is None:
        pytest.skip("no machine is named: --hil MACHINE")
    with Bench(machine) as bench:
        yield bench
