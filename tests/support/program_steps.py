"""Steps of a program file of the X-Y table, as text in the file's units; joined they are a program."""


def move(x_mm: float, y_mm: float, feed_mm_min: float, label: str = "to the start") -> str:
    """A straight move to a position."""
    return (
        f'\n[[step]]\nkind = "move"\nlabel = "{label}"\n'
        f"to_mm = {{ x = {x_mm}, y = {y_mm} }}\nfeed_mm_min = {feed_mm_min}\n"
    )


def circle(
    radius_mm: float,
    feed_mm_min: float,
    turns: float = 1.0,
    label: str = "round",
    ramp_s: float | None = None,
) -> str:
    """A circle from the present position, its centre + (radius, 0); `ramp_s` None: the file's default."""
    ramp = "" if ramp_s is None else f"ramp_s = {ramp_s}\n"
    return (
        f'\n[[step]]\nkind = "circle"\nlabel = "{label}"\nradius_mm = {radius_mm}\n'
        f"feed_mm_min = {feed_mm_min}\nturns = {turns}\n{ramp}"
    )


def dwell(seconds: float, label: str = "rest") -> str:
    """A standstill."""
    return f'\n[[step]]\nkind = "dwell"\nlabel = "{label}"\nseconds = {seconds}\n'


def circle_about_origin(
    radius_mm: float, feed_mm_min: float, turns: float, *, label: str, ramp_s: float, move_mm_min: float
) -> str:
    """From the origin to (radius, 0), the circle, and back; both moves at `move_mm_min`."""
    there = move(radius_mm, 0.0, move_mm_min)
    back = move(0.0, 0.0, move_mm_min, "home")
    return there + circle(radius_mm, feed_mm_min, turns, label=label, ramp_s=ramp_s) + back
