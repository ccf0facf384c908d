"""The published machines by the names of `reconcile example` and of the benchmark."""

from collections.abc import Mapping

from reconcile.examples.real import bam, dfki, fditools, kinova, kuka
from reconcile.examples.real.machine import Read

MACHINES: Mapping[str, Read] = {
    "fditools_motor": fditools.motor_only,
    "fditools_load": fditools.with_load_encoder,
    "kuka": kuka.robot,
    "dfki_a": dfki.build_a,
    "dfki_c": dfki.build_c,
    "kinova": kinova.cobot,
    "bam": bam.pendulum,
}
SETS: Mapping[str, tuple[str, ...]] = {
    "fditools": ("fditools_motor", "fditools_load"),
    "kuka": ("kuka",),
    "dfki": ("dfki_a", "dfki_c"),
    "kinova": ("kinova",),
    "bam": ("bam",),
}
"""The machines of each name of `reconcile example`."""
