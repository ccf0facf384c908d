"""What the node id adds where nodes share an EDS, against the library that reads it for each node."""

from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable

from hil_sim.node.dictionary import described
from servo_ctrl.canopen.stack import load_eds

EDS = Path(__file__).parents[3] / "eds"


@pytest.mark.parametrize("name", ["servo_drive.eds", "linear_scale.eds", "servo_ctrl.eds"])
@pytest.mark.parametrize("node_id", [1, 127])
def test_nodes_that_share_a_file_have_their_own_defaults(name: str, node_id: int) -> None:
    dictionary = canopen.import_od(str(EDS / name), node_id)
    members = [[entry] if isinstance(entry, ODVariable) else entry.values() for entry in dictionary.values()]
    expected = {(v.index, v.subindex): v.default for entry in members for v in entry}
    relative = {address for address in expected if 0x1400 <= address[0] < 0x1C00 and address[1] == 1}
    load_eds(EDS / name, 5)
    found = load_eds(EDS / name, node_id).variables
    simulated = described((EDS / name).read_bytes(), name, node_id)
    numbers = {address for address, default in expected.items() if isinstance(default, int)}
    assert relative <= numbers
    assert {address: found[address].default for address in numbers} == {a: expected[a] for a in numbers}
    assert {address: entry.default for address, entry in simulated.items()} == expected
