"""Compiled PDO codecs against the canopen library's PDO encoding, and impossible mappings."""

from pathlib import Path
from typing import Any

import canopen
import pytest
from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.pdo import STRUCT_FORMATS, PdoCodec, compile_pdo, find
from servo_ctrl.canopen.stack import EdsVariable, load_eds

EDS_PATH = Path(__file__).parents[3] / "eds" / "servo_drive.eds"
EDS = load_eds(EDS_PATH, 1)
LIBRARY_EDS = canopen.import_od(str(EDS_PATH), 1)
RANGES = {"b": (-(2**7), 2**7 - 1), "h": (-(2**15), 2**15 - 1), "i": (-(2**31), 2**31 - 1)}
RANGES |= {"B": (0, 2**8 - 1), "H": (0, 2**16 - 1), "I": (0, 2**32 - 1)}
RECEIVABLE = [
    variable
    for variable in EDS.variables.values()
    if variable.pdo_mappable
    and variable.access in {"rw", "rww", "wo"}
    and STRUCT_FORMATS.get(variable.data_type) in RANGES
]


def codec_of(variables: list[EdsVariable]) -> PdoCodec:
    return compile_pdo(EDS, [variable.address for variable in variables], receive=True)


@st.composite
def mapped_values(draw: st.DrawFn) -> list[tuple[EdsVariable, int]]:
    """Any mapping of at most 8 bytes, with a value for each object."""
    chosen: list[tuple[EdsVariable, int]] = []
    left = 8
    for variable in draw(st.lists(st.sampled_from(RECEIVABLE), min_size=1, max_size=8)):
        form = STRUCT_FORMATS[variable.data_type]
        size = {"b": 1, "B": 1, "h": 2, "H": 2, "i": 4, "I": 4}[form]
        if size <= left:
            left -= size
            chosen.append((variable, draw(st.integers(*RANGES[form]))))
    return chosen


def library_map(variables: list[EdsVariable]) -> Any:
    node = canopen.RemoteNode(1, LIBRARY_EDS)
    pdo = node.rpdo[1]
    pdo.clear()
    for variable in variables:
        pdo.add_variable(variable.index, variable.subindex)
    return pdo


@given(mapped_values())
def test_payload_is_the_one_of_the_canopen_library(chosen: list[tuple[EdsVariable, int]]) -> None:
    variables = [variable for variable, _ in chosen]
    theirs = library_map(variables)
    for place, (_, value) in enumerate(chosen):
        theirs.map[place].raw = value
    codec = codec_of(variables)
    payload = codec.pack(*(value for _, value in chosen))
    assert payload == bytes(theirs.data)
    assert codec.unpack(payload) == tuple(value for _, value in chosen)


@given(mapped_values())
def test_mapping_entry_is_index_subindex_and_bits(chosen: list[tuple[EdsVariable, int]]) -> None:
    variables = [variable for variable, _ in chosen]
    for mapped, theirs in zip(codec_of(variables).objects, library_map(variables).map, strict=True):
        assert mapped.mapping_entry == theirs.index << 16 | theirs.subindex << 8 | theirs.length


def test_names_and_addresses_mean_the_same() -> None:
    assert find(EDS, "target_torque") == find(EDS, "0x6071:00")
    assert find(EDS, "0x607d:01").index == 0x607D


def test_position_of_an_object_that_is_not_mapped_is_none() -> None:
    codec = compile_pdo(EDS, ["controlword", "target_torque"], receive=True)
    assert (codec.position(0x6071), codec.position(0x60FF)) == (1, None)


@pytest.mark.parametrize(
    ("names", "receive", "complaint"),
    [
        (["target_torqe"], True, 'has no object "target_torqe"'),
        (["0x5FFF:00"], True, 'has no object "0x5FFF:00"'),
        (["statusword"], True, "statusword (0x6041:00) cannot be mapped into an RPDO"),
        (["controlword", "target_position", "target_velocity"], True, "10 bytes; a PDO carries 8"),
        (["0x1008:00"], False, "cannot be mapped into a TPDO"),
    ],
)
def test_impossible_mapping_names_eds_and_object(names: list[str], receive: bool, complaint: str) -> None:
    with pytest.raises(EdsError) as caught:
        compile_pdo(EDS, names, receive=receive)
    assert complaint in str(caught.value)
    assert str(EDS_PATH) in str(caught.value)
