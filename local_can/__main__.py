"""`python -m local_can SOCKET_PATH`: run a hub until SIGTERM or SIGINT."""

import argparse
import contextlib
import logging
import signal
import sys
from pathlib import Path

from kernels.batch_scheduling import batch_scheduling
from local_can.hub import Hub
from local_can.listening import HubError

_LOG = logging.getLogger("local_can")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m local_can",
        description="A CAN bus on a Unix socket; clients open it by python-can's interface localcan.",
    )
    parser.add_argument("socket_path", type=Path, metavar="SOCKET_PATH", help="where clients find the bus")
    for option, default, meaning in (
        ("--bitrate", 0, "pace frames at this bitrate in bit/s; 0: do not pace"),
        ("--queue-frames", 16384, "frames that may wait for a slow reader"),
        ("--patience-ms", 250, "how long the unpaced bus waits for a reader whose queue is full"),
    ):
        text = f"{meaning} (default %(default)s)"
        parser.add_argument(option, type=_count, default=default, metavar="N", help=text)
    parser.add_argument(
        "--batch",
        action="store_true",
        help="never interrupt a sender (SCHED_BATCH): bursts pass in one go, which suits lockstep",
    )
    return parser.parse_args()


def _count(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of 0 or more")
    return int(text)


def main() -> int:
    """Run a hub; return the exit status, 0 after a signal and 1 if no hub is possible at the path."""
    logging.basicConfig(level=logging.INFO, format="local_can: %(message)s")
    arguments = _arguments()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: sys.exit(0))
    try:
        hub = Hub(
            arguments.socket_path,
            bitrate=arguments.bitrate,
            queue_frames=arguments.queue_frames,
            patience_s=arguments.patience_ms / 1000.0,
        )
    except HubError as error:
        _LOG.error("%s", error)
        return 1
    # waking up for every frame would cost a third more processor time
    scheduling = batch_scheduling() if arguments.batch else contextlib.nullcontext()
    with scheduling, contextlib.closing(hub):
        _LOG.info("bus at %s", arguments.socket_path)
        hub.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
