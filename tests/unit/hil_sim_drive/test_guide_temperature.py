"""The thermometer at the guide in 2012h: lag, noise and resolution, and none without a sensor."""

from pathlib import Path

import canopen
import numpy as np
import pytest
from in_process_nodes import IDEAL_AXIS, InProcessNodes, SdoDrive
from machine_files import text_of, write_plant

from hil_sim.config import ConfigError, TemperatureProbe, load_plant
from hil_sim.drive.temperature_probe import ProbeReading

PROBE = """
[axis.x.temperature_probe]
surroundings_degc = {degc}
lag_s = 0.5
noise_k = 0.0
"""
NO_DATA = 0x08000024


def plant_at(tmp_path: Path, degc: float) -> Path:
    return write_plant(tmp_path, text_of(IDEAL_AXIS) + PROBE.format(degc=degc))


@pytest.mark.parametrize(("degc", "counts"), [(23.44, 234), (-7.26, -73)])
def test_it_reads_tenths_of_a_degree(tmp_path: Path, degc: float, counts: int) -> None:
    assert SdoDrive(InProcessNodes(plant_at(tmp_path, degc))).get(0x2012) == counts


def test_it_follows_the_lubricant_with_its_lag(tmp_path: Path) -> None:
    nodes = InProcessNodes(plant_at(tmp_path, 20.0))
    drive = SdoDrive(nodes)
    assert drive.get(0x2012) == 200
    nodes.bench.plant.state[0]["temperature_dependent_friction"]["temperature_rise_k"] = 10.0
    nodes.sync(500)
    assert drive.get(0x2012) == pytest.approx(200 + 100 * (1.0 - np.exp(-1.0)), abs=1)


def test_without_a_sensor_there_is_no_data() -> None:
    with pytest.raises(canopen.SdoAbortedError) as refused:
        SdoDrive(InProcessNodes()).get(0x2012)
    assert refused.value.code == NO_DATA


def test_its_noise_is_that_of_the_file_and_the_same_every_time() -> None:
    noisy = TemperatureProbe(surroundings_degc=20.0, lag_s=20.0, noise_k=0.5)
    first, again = (ProbeReading(noisy, 7) for _ in range(2))
    readings = [first.counts(float(s), 0.0) for s in range(2000)]
    assert np.std(readings) == pytest.approx(5.0, rel=0.1)
    assert np.mean(readings) == pytest.approx(200.0, abs=0.5)
    assert [again.counts(float(s), 0.0) for s in range(2000)] == readings


def test_a_sensor_without_lag_is_refused(tmp_path: Path) -> None:
    text = text_of(IDEAL_AXIS) + PROBE.format(degc=20.0).replace("0.5", "0.0")
    with pytest.raises(ConfigError, match=r"temperature_probe\.lag_s"):
        load_plant(write_plant(tmp_path, text))
