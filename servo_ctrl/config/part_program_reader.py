"""Converts the blocks of a part program to paths and dwells, and keeps the modal state.

A path goes from rest to rest. It ends at a dwell, at a change of the corner tolerance and at the end. The
first motion is a separate path, so that all later motion is independent of the start position.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from servo_ctrl.config.part_program import PartProgram, ProgramEntry, ReadingOptions, Remark
from servo_ctrl.config.program_model import LONGEST_STEP_S
from servo_ctrl.errors import ConfigError
from servo_ctrl.motion.gcode.block import SortedBlock, sorted_block
from servo_ctrl.motion.gcode.blocks import blocks, line_key, read_text
from servo_ctrl.motion.gcode.path_builder import USUAL_TOLERANCE_M, Modes, PathBuilder, unknown_axis
from servo_ctrl.motion.gcode.words import Effect
from servo_ctrl.motion.move import Dwell
from servo_ctrl.units import MM

INCH_M = 25.4 * MM
_OPTIONAL_BLOCK_TEXT = "is carried out; --block-delete leaves such blocks out"


def read_part_program(path: Path, axes: Sequence[str], options: ReadingOptions | None = None) -> PartProgram:
    """Read the program in `path` for a machine with these axes. Raises ConfigError with file and line."""
    return _PartProgramReader(path, axes, options or ReadingOptions()).read(read_text(path))


class _PartProgramReader:
    """Reads one program for the axes of a machine."""

    def __init__(self, source: Path, axes: Sequence[str], options: ReadingOptions) -> None:
        self._source, self._options = source, options
        for axis in options.work_offset_mm:
            if axis not in axes:
                raise ConfigError(source, "--g54", unknown_axis(axis, axes))
        offsets_m = {"G54": {}, **options.work_offsets_m}
        self._g54_m = {
            axis: options.work_offset_mm[axis] * MM
            if axis in options.work_offset_mm
            else offsets_m["G54"].get(axis, 0.0)
            for axis in axes
        }
        offsets_m["G54"] = self._g54_m
        self._offsets_m = {
            name: [of_axis.get(axis, 0.0) for axis in axes] for name, of_axis in offsets_m.items()
        }
        self._modes = replace(options.modes) if options.modes is not None else Modes()
        self._path = PathBuilder(list(axes), self._offsets_m, self._modes, options.start_m)
        self._remarks: list[Remark] = []
        self._optional_stops: list[int] = []
        self._entry: ProgramEntry | None = None

    def read(self, text: str) -> PartProgram:
        """Read the whole program up to its end."""
        line, block_count, ended, first_line = 1, 0, False, self._options.first_line
        for block in blocks(text, self._source):
            line, ended = block.line, not block.words
            if ended:
                break
            if block.optional and self._options.block_delete:
                continue
            if block.optional:
                self._remarks.append(Remark(line, "/", _OPTIONAL_BLOCK_TEXT))
            if line >= first_line > 1 and self._entry is None:
                self._enter_program(line)
            parsed = sorted_block(block, self._source, first=block_count == 0)
            block_count += 1
            self._remarks += [Remark(line, word.text, Effect.NONE.value) for word in parsed.without_effect]
            self._execute(parsed)
            if parsed.codes.get("stop") in {"M2", "M30"}:
                ended = True
                break
        self._path.end_path()
        if first_line > 1 and self._entry is None:
            raise ConfigError(self._source, line_key(first_line), f"the program ends before, at line {line}")
        if not self._path.steps and self._options.start_m is None:
            raise ConfigError(self._source, line_key(line), "the program ends here and has moved nothing")
        if not ended:
            self._remarks.append(Remark(line, "", "ends without M2, M30 or %: is the file complete?"))
        return PartProgram(
            source=self._source,
            motion=self._path.steps,
            remarks=self._remarks,
            blocks=block_count,
            work_offset_m=self._g54_m,
            optional_stops=self._optional_stops,
            entry=self._entry,
            modes=self._modes,
            start_m=self._options.start_m,
        )

    def _enter_program(self, line: int) -> None:
        """Let the motion begin at this line, with the present modal state."""
        self._entry = ProgramEntry(line, self._modes.words, tuple(self._path.position_m))
        self._optional_stops.clear()
        self._path.begin_at(line)

    def _execute(self, block: SortedBlock) -> None:
        """Execute a block in the order: modes, feed, dwell or motion."""
        codes = block.codes
        if "dwell" in codes and codes.keys() & {"motion", "path control", "exact stop"}:
            block.fail("G4 needs a block of its own")
        self._set_modes(block)
        if codes.get("stop") == "M1":
            self._optional_stops.append(block.line)
        if "dwell" in codes:
            self._dwell(block)
        else:
            self._path.move(block)
            if "exact stop" in codes:
                block.fail("G9 belongs to a motion")
        if block.words:
            unused = ", ".join(word.text for word in block.words.values())
            block.fail(f"{unused}: means nothing in this block")

    def _set_modes(self, block: SortedBlock) -> None:
        modes, codes = self._modes, block.codes
        modes.motion = codes.get("motion", modes.motion)
        if "plane" in codes:
            modes.plane = codes["plane"]
            self._path.plane_axes(block)
        if "units" in codes:
            modes.unit_m = INCH_M if codes["units"] == "G20" else MM
        if "work offset" in codes:
            if codes["work offset"] not in self._offsets_m:
                block.fail(f"{codes['work offset']} was never set: touch off, or clear it, first")
            modes.work_offset = codes["work offset"]
        if "distance" in codes:
            modes.absolute = codes["distance"] == "G90"
        if "path control" in codes:
            modes.exact = codes["path control"] == "G61"
            if not modes.exact:
                self._set_tolerance(block)
        feed = block.take("F")
        if feed is not None:
            if feed <= 0.0:
                block.fail(f"F {feed:g}: the feed must be above 0")
            modes.feed_m_s = feed * modes.unit_m / 60.0

    def _set_tolerance(self, block: SortedBlock) -> None:
        value = block.take("P")
        tolerance_m = USUAL_TOLERANCE_M if value is None else value * self._modes.unit_m
        if tolerance_m < 0.0:
            block.fail(f"G64 P {value:g}: the tolerance must not be below 0")
        if tolerance_m != self._modes.tolerance_m:
            self._path.end_path()
            self._modes.tolerance_m = tolerance_m

    def _dwell(self, block: SortedBlock) -> None:
        letter = "P" if "P" in block.words else "X"
        seconds = block.take(letter)
        if seconds is None:
            block.fail("G4 needs its time: P or X, in seconds")
        if not 0.0 <= seconds <= LONGEST_STEP_S:
            block.fail(f"{letter} {seconds:g}: a dwell takes 0 to {LONGEST_STEP_S:g} seconds")
        self._path.end_path()
        if seconds > 0.0:
            self._path.steps.append(Dwell(f"dwell, line {block.line}", seconds))
