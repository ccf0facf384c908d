"""The stock canopen exchange, the benchmark's peer, does run; and cyclictest's histogram is read rightly."""

from pathlib import Path

import pytest

from tests.campaigns.bench.cyclictest import HISTOGRAM_US, histogram_of, percentile_us
from tests.campaigns.bench.lockstep import BARE, STOCK, peer_hub, run_peer
from tests.campaigns.bench.outcome import Ratio


@pytest.mark.parametrize("script", [STOCK, BARE], ids=["stock canopen", "bare sockets"])
def test_the_other_exchanges_run_a_few_cycles(script: Path) -> None:
    with peer_hub() as (socket, hub):
        assert run_peer(script, socket, hub, cycles=20).cycles == 20


def test_the_histogram_of_cyclictest_is_read_with_its_overflows() -> None:
    printed = "# Histogram\n000000 000000\n000014 000097\n000031 000002\n# Total: 000000099\n"
    counts = histogram_of(printed + "# Histogram Overflows: 00001\n")
    assert counts == {14: 97, 31: 2, HISTOGRAM_US: 1}
    assert [percentile_us(counts, share) for share in (0.5, 0.97, 0.98, 0.99, 1.0)] == [
        14,
        14,
        31,
        31,
        20_000,
    ]


@pytest.mark.parametrize(("at_most", "met"), [(True, False), (False, True)])
def test_a_ratio_is_held_against_its_aim(*, at_most: bool, met: bool) -> None:
    ratio = Ratio("", 6.0, 2.0, "s", 2.5, at_most=at_most)
    assert ratio.value == pytest.approx(3.0)
    assert ratio.met is met
    assert ratio._replace(aim=None).met is None
