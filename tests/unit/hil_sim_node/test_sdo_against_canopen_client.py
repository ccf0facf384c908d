"""canopen's own SDO client, block transfers with CRC included, as the counterpart of the server."""

import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from in_process_nodes import DRIVE, EDS, InProcessNodes


@pytest.fixture
def node() -> canopen.RemoteNode:
    return InProcessNodes().remote(DRIVE)


def write_block(node: canopen.RemoteNode, data: bytes, crc: bool = True) -> None:
    with node.sdo[0x2000].open("wb", size=len(data), block_transfer=True, request_crc_support=crc) as stream:
        stream.write(data)


def read_block(node: canopen.RemoteNode, index: int, crc: bool = True) -> bytes:
    with node.sdo[index].open("rb", block_transfer=True, request_crc_support=crc) as stream:
        return stream.read()


@pytest.mark.parametrize("crc", [True, False])
@pytest.mark.parametrize("size", [1, 6, 7, 8, 889, 890, 4000])
def test_block_transfers_bring_the_data_there_and_back(
    node: canopen.RemoteNode, size: int, crc: bool
) -> None:
    data = bytes(n * 7 % 251 for n in range(size))
    write_block(node, data, crc)
    assert read_block(node, 0x2000, crc) == data
    assert node.sdo[0x2000].raw == data


def test_the_node_carries_its_own_eds(node: canopen.RemoteNode) -> None:
    text = (EDS / "servo_drive.eds").read_bytes()
    assert read_block(node, 0x1021) == text
    assert node.sdo[0x1021].raw == text


@given(data=st.binary(min_size=1, max_size=300))
@settings(max_examples=30, deadline=None)
def test_every_transfer_type_carries_any_bytes(data: bytes) -> None:
    node = SHARED
    node.sdo[0x2000].raw = data
    assert read_block(node, 0x2000) == data
    write_block(node, data[::-1])
    assert node.sdo[0x2000].raw == data[::-1]


SHARED = InProcessNodes().remote(DRIVE)


def test_aborts_arrive_with_their_code(node: canopen.RemoteNode) -> None:
    for index, subindex, value, code in (
        (0x605A, None, 9, 0x06090031),
        (0x6060, None, 2, 0x06090030),
        (0x6041, None, 1, 0x06010002),
        (0x1029, 1, 3, 0x06090031),
        (0x1010, 1, 1, 0x08000020),
    ):
        entry = node.sdo[index] if subindex is None else node.sdo[index][subindex]
        with pytest.raises(canopen.SdoAbortedError) as refused:
            entry.raw = value
        assert refused.value.code == code, f"{index:04X}"
