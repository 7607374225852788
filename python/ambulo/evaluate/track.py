"""Courses of waypoints, as TOML files."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, NoReturn

GAITS = ("walk", "jog", "crouch", "run", "auto")
# A published speed of 1 means a centimetre per 60 Hz frame.
UNITS = {"m_per_s": 1.0, "cm_per_frame": 0.6}
# Metres a second: below the first a character stands, and above the second nobody runs.
SLOWEST, FASTEST = 0.06, 20.0


class TrackError(ValueError):
    """A track file cannot be used; the message says where and why."""


@dataclass(frozen=True)
class Waypoint:
    """A place to reach and the way to move on the way to it."""

    position: tuple[float, float]
    """x, z, metres."""
    gait: str
    speed: float
    """Metres a second."""
    strafe: tuple[float, float] | None
    """Direction (x, z) to face, a unit vector; None: along the movement."""


@dataclass(frozen=True)
class Track:
    """A closed course: a lap starts at the last waypoint and visits all in order."""

    name: str
    reach: float
    """Distance from a waypoint at which it counts as reached, metres."""
    waypoints: tuple[Waypoint, ...]

    @property
    def start(self) -> tuple[float, float]:
        """Where a lap starts (x, z)."""
        return self.waypoints[-1].position

    def leg_length(self, index: int) -> float:
        """Metres from the waypoint before to a waypoint, in a straight line."""
        return math.dist(self.waypoints[index].position, self.waypoints[index - 1].position)

    def leg_time(self, index: int) -> float:
        """Seconds that the way to a waypoint takes in a straight line at the asked speed."""
        return self.leg_length(index) / self.waypoints[index].speed

    def ahead(
        self, index: int, place: tuple[float, float], lookahead: float
    ) -> tuple[float, float]:
        """The point of a leg `lookahead` metres beyond the one nearest to `place`.

        At most the leg's end.
        """
        origin, end = self.waypoints[index - 1].position, self.waypoints[index].position
        length = self.leg_length(index)
        along = ((end[0] - origin[0]) / length, (end[1] - origin[1]) / length)
        at = (place[0] - origin[0]) * along[0] + (place[1] - origin[1]) * along[1]
        at = min(max(at, 0.0) + lookahead, length)
        return (origin[0] + along[0] * at, origin[1] + along[1] * at)


def load_track(name_or_path: str | Path) -> Track:
    """Load the shipped track `seeds`, or a TOML file.

    Raises:
        TrackError: not a track; the message names the file and the place in it.
    """
    if str(name_or_path) == "seeds":
        text = (resources.files("ambulo") / "data" / "track_seeds.toml").read_text()
        return parse_track(text, "seeds")
    path = Path(name_or_path)
    try:
        return parse_track(path.read_text(), str(path))
    except FileNotFoundError:
        raise TrackError(f"{path}: no such file; the shipped track is called 'seeds'") from None
    except (OSError, UnicodeDecodeError) as error:
        raise TrackError(f"{path}: {error}") from error


def parse_track(text: str, source: str) -> Track:
    """Check and read a track's text; `source` is named in messages."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise TrackError(f"{source}: not TOML: {error}") from None
    reader = _Reader(source)
    reader.only(table, "", {"name", "speed_unit", "reach", "waypoint"})
    unit = table.get("speed_unit", "m_per_s")
    if not isinstance(unit, str) or unit not in UNITS:
        reader.fail("speed_unit", f"one of {', '.join(UNITS)}", unit)
    listed = table.get("waypoint")
    if not isinstance(listed, list) or len(listed) < 2:
        reader.fail("waypoint", "two or more [[waypoint]] tables", listed)
    waypoints = tuple(
        reader.waypoint(entry, f"waypoint[{i}]", unit) for i, entry in enumerate(listed)
    )
    reach = reader.positive(table.get("reach", 1.0), "reach")
    for i, waypoint in enumerate(waypoints):
        apart = math.dist(waypoint.position, waypoints[i - 1].position)
        if apart <= reach:
            # It would count as reached without a step.
            expected = f"a place more than reach = {reach:g} m from the one before"
            reader.fail(f"waypoint[{i}].position", expected, f"{apart:g} m")
    name = table.get("name", Path(source).stem)
    if not isinstance(name, str):
        reader.fail("name", "text", name)
    return Track(name, reach, waypoints)


class _Reader:
    def __init__(self, source: str) -> None:
        self.source = source

    def fail(self, path: str, expected: str, found: Any) -> NoReturn:
        raise TrackError(f"{self.source}: {path}: expected {expected}, found {found!r}")

    def only(self, table: Any, path: str, known: set[str]) -> None:
        if not isinstance(table, dict):
            self.fail(path, "a table", table)
        for key in table:
            if key not in known:
                at = f"{path}.{key}" if path else key
                self.fail(at, f"one of {', '.join(sorted(known))}", key)

    def number(self, value: Any, path: str) -> float:
        good = isinstance(value, int | float) and not isinstance(value, bool)
        if not good or not abs(value) <= 1e5:
            self.fail(path, "a number of at most 100000", value)
        return float(value)

    def positive(self, value: Any, path: str) -> float:
        number = self.number(value, path)
        if number <= 0.0:
            self.fail(path, "a number above 0", value)
        return number

    def speed(self, value: Any, path: str, unit: str) -> float:
        """Metres a second from a number in `unit`."""
        low, high = SLOWEST / UNITS[unit], FASTEST / UNITS[unit]
        number = self.number(value, path)
        # A limit that is written in the file's unit may miss it by a rounding.
        if not low - 1e-9 <= number <= high + 1e-9:
            metres = "" if unit == "m_per_s" else f" ({SLOWEST:g} to {FASTEST:g} m_per_s)"
            self.fail(path, f"{low:g} to {high:g} {unit}{metres}", value)
        return number * UNITS[unit]

    def pair(self, value: Any, path: str) -> tuple[float, float]:
        if not isinstance(value, list) or len(value) != 2:
            self.fail(path, "two numbers [x, z]", value)
        return (self.number(value[0], f"{path}[0]"), self.number(value[1], f"{path}[1]"))

    def waypoint(self, table: Any, path: str, unit: str) -> Waypoint:
        self.only(table, path, {"position", "gait", "speed", "strafe"})
        gait = table.get("gait", "walk")
        if gait not in GAITS:
            self.fail(f"{path}.gait", f"one of {', '.join(GAITS)}", gait)
        strafe = None
        if "strafe" in table:
            x, z = self.pair(table["strafe"], f"{path}.strafe")
            length = math.hypot(x, z)
            if length < 1e-6:
                self.fail(f"{path}.strafe", "a direction that is not zero", table["strafe"])
            strafe = (x / length, z / length)
        return Waypoint(
            position=self.pair(table.get("position"), f"{path}.position"),
            gait=gait,
            speed=self.speed(table.get("speed"), f"{path}.speed", unit),
            strafe=strafe,
        )
