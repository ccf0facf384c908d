"""The node id and bit rate that LSS has assigned: a small file per device, beside its stored parameters."""

import json
from pathlib import Path
from typing import NamedTuple

from hil_sim.node.storage import StoredParametersError, replace_json

FORMAT = 1
RATES_KBIT_S = (1000, 800, 500, 250, 125, 50, 20)


class StoredLss(NamedTuple):
    """Node id and bit rate; None where LSS has assigned none."""

    node_id: int | None = None
    bit_rate_kbit_s: int | None = None


def stored_lss(file: Path | None) -> StoredLss:
    """Read the file; without one nothing is assigned. Raises StoredParametersError for a damaged file."""
    if file is None or not file.exists():
        return StoredLss()
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        number, node_id = content["format"], content["node_id"]
        rate = content.get("bit_rate_kbit_s")  # files had none before bit timing
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise StoredParametersError(file, f"no node id: {error}") from error
    if number != FORMAT or type(node_id) is not int or not (1 <= node_id <= 127 or node_id == 255):
        raise StoredParametersError(file, f"no node id: {content}")
    if rate is not None and rate not in RATES_KBIT_S:
        raise StoredParametersError(file, f"no bit rate: {content}")
    return StoredLss(node_id, rate)


def store_lss(file: Path, node_id: int, bit_rate_kbit_s: int) -> bool:
    """Write the file in one step; return whether that worked."""
    try:
        replace_json(file, {"format": FORMAT, "node_id": node_id, "bit_rate_kbit_s": bit_rate_kbit_s})
    except OSError:
        return False
    return True
