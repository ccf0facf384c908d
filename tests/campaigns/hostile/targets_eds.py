"""Fuzz targets: EDS files, as controller and simulator read them."""

from hil_sim.node.dictionary import Dictionary
from hil_sim.node.process_objects import ProcessObjects
from hil_sim.node.sdo_server import SdoServer
from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.stack import load_eds
from tests.campaigns.hostile.targets import file_with, target

SMALL_EDS = b"""[FileInfo]
FileName=small.eds
[DeviceInfo]
ProductName=small
NrOfRXPDO=1
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[1001]
ParameterName=Error register
DataType=0x0005
AccessType=ro
DefaultValue=0
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
PDOMapping=0
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index supported
DataType=0x0005
AccessType=ro
DefaultValue=1
[1018sub1]
ParameterName=Vendor-ID
DataType=0x0007
AccessType=ro
DefaultValue=$NODEID+0x10
[OptionalObjects]
SupportedObjects=2
1=0x1003
2=0x6064
[1003]
ParameterName=Errors
ObjectType=0x8
DataType=0x0007
AccessType=ro
CompactSubObj=3
[6064]
ParameterName=Position actual value
DataType=0x0004
AccessType=ro
PDOMapping=1
LowLimit=-5
HighLimit=0x7FFFFFFF
"""
EDS_WORDS = (b"CompactSubObj=9", b"$NODEID+", b"DataType=", b"0x8", b"[1000]", b"SubNumber=", b"%", b"%(x)s")


@target("canopen.objectdictionary.eds", lambda: [SMALL_EDS], declared=EdsError, words=EDS_WORDS)
def eds_of_the_controller(data: bytes) -> None:
    load_eds(file_with(data, "small.eds"), 1)


class RefusedError(Exception):
    """An error that `hil_sim.runner.bench` raises as ConfigError."""


@target("hil_sim.node.dictionary", lambda: [SMALL_EDS], declared=RefusedError, words=EDS_WORDS, short=150)
def eds_of_the_simulator(data: bytes) -> None:
    """Read an EDS file as `hil_sim.runner.bench` does: any error of canopen's importer is one error."""
    try:
        dictionary = Dictionary(1, file_with(data, "drive.eds"), ProcessObjects())
    except Exception as error:  # whatever it is: that is the promise of the bench
        raise RefusedError(f"no usable EDS: {error!r}") from error
    server = SdoServer(dictionary, lambda _id, _data: None)
    for frame in (b"\x40\x00\x10\0\0\0\0\0", b"\x40\x64\x60\0\0\0\0\0", b"\x23\x18\x10\x01\1\2\3\4"):
        server.on_request(frame)
