"""Films and pictures of a character in a scene, with the objects that it uses.

`write_scene_film` makes a GIF, or an MP4 where ffmpeg is on the PATH; `draw_scene` one picture;
`write_scene_strip` a PNG of chosen moments; `write_scene_plan` the scene seen from above. Times are
seconds from the first frame of the recording.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from ambulo.files import replacing
from ambulo.pictures.drawing import Camera
from ambulo.pictures.encode import write_pictures
from ambulo.pictures.film import check_size
from ambulo.pictures.mannequin import Mannequin
from ambulo.pictures.scene_camera import Watch
from ambulo.pictures.scene_paint import Painter
from ambulo.pictures.scene_plan import write_scene_plan
from ambulo.pictures.scene_set import Props
from ambulo.pictures.stage import INK, PAPER, QUIET, Picture, caption, font, to_bytes
from ambulo.scene_recording import SceneRecording

__all__ = ["draw_scene", "write_scene_film", "write_scene_plan", "write_scene_strip"]

Progress = Callable[[int, int], object]

VEIL = 130  # of 255: how pale the picture is under its words


def write_scene_film(
    path: str | Path,
    recording: SceneRecording,
    *,
    size: tuple[int, int] = (640, 360),
    fps: int = 25,
    start: float = 0.0,
    stop: float | None = None,
    title: str = "",
    marks: bool = True,
    progress: Progress | None = None,
) -> Path:
    """Writes the seconds `start` to `stop` (None: the end) as a film, `.gif` or `.mp4` by `path`.

    `size` in pixels; `fps` pictures a second, for a GIF a divisor of 100; `marks`: the recording's
    targets are drawn. The camera finds its own way (`scene_camera`). `progress(done, total)` is
    called after every picture. A file appears only when it is whole. Raises ValueError for
    arguments that cannot be filmed and RuntimeError where ffmpeg is needed and fails or is absent.
    """
    path = Path(path)
    check_size(size)
    if fps <= 0:
        raise ValueError(f"fps must be above 0, not {fps}")
    stop = _check_span(recording, start, stop)
    count = max(int((stop - start) * fps + 1e-6), 1)
    times = start + np.arange(count) / fps
    shoot = _Shoot(recording)
    cameras = shoot.watch.cameras(times * recording.fps, size)
    firm = shoot.watch.solidity(times * recording.fps, cameras)

    def paint(k: int) -> Picture:
        time = float(times[k])
        picture = to_bytes(
            shoot.painter.paint(time * recording.fps, cameras[k], solidity=firm[k], marks=marks)
        )
        fields = _fields(recording, time)
        return caption(_veiled(picture, title, fields), title, fields)

    return write_pictures(path, count, paint, size=size, fps=fps, progress=progress)


def draw_scene(
    recording: SceneRecording,
    time: float,
    *,
    size: tuple[int, int] = (640, 360),
    camera: Camera | None = None,
    marks: bool = True,
) -> Picture:
    """The scene at `time` seconds, (H, W, 3) bytes for `size` (W, H) in pixels.

    `camera`: one of `size`; None: the one that a film would have then. Raises ValueError for a
    time outside the recording and a size out of range.
    """
    check_size(size)
    _check_time(recording, time)
    if camera is not None and camera.size != size:
        raise ValueError(f"the camera's picture is {camera.size}, not {size}")
    if camera is not None:
        painter = Painter(recording, camera.sun)
        return to_bytes(painter.paint(time * recording.fps, camera, marks=marks))
    return _Shoot(recording).picture(time, size, marks)


def write_scene_strip(
    path: str | Path,
    recording: SceneRecording,
    moments: Sequence[float],
    *,
    size: tuple[int, int] = (320, 240),
    columns: int = 4,
    title: str = "",
    marks: bool = False,
) -> Path:
    """Writes one PNG: a picture of `size` pixels for each of `moments` (seconds), `columns` a row.

    Below each are its time and the event that goes on then. A file appears only when it is whole.
    Raises ValueError for no moments, moments outside the recording, and sizes out of range.
    """
    path = Path(path)
    check_size(size)
    if not len(moments):
        raise ValueError("no moments: give at least one time in seconds")
    if columns < 1:
        raise ValueError(f"columns must be at least 1, not {columns}")
    for time in moments:
        _check_time(recording, time)
    shoot = _Shoot(recording)
    unit = size[1] / 240.0
    margin, gap, foot = round(16 * unit), round(8 * unit), round(26 * unit)
    head = round(34 * unit) if title else 0
    across = min(columns, len(moments))
    down = -(-len(moments) // across)
    width = 2 * margin + across * size[0] + (across - 1) * gap
    height = 2 * margin + head + down * (size[1] + foot) + (down - 1) * gap
    sheet = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(sheet)
    if title:
        draw.text((margin, margin), title, INK, font(20.0 * unit), "lt")
    for k, time in enumerate(moments):
        row, column = divmod(k, across)
        x = margin + column * (size[0] + gap)
        y = margin + head + row * (size[1] + foot + gap)
        sheet.paste(Image.fromarray(shoot.picture(time, size, marks)), (x, y))
        words, base = font(12.5 * unit), y + size[1] + 17 * unit
        seconds = f"{recording.began + time:.1f} s"
        draw.text((x, base), seconds, QUIET, words, "ls")
        aside = max(words.getlength("00.0 s "), words.getlength(f"{seconds} ")) + 4 * unit
        draw.text((x + aside, base), recording.event_at(time), INK, words, "ls")
    with replacing(path) as part:
        sheet.save(part, "PNG", optimize=True)
    return path


class _Shoot:
    """A camera course and a painter of one recording."""

    def __init__(self, recording: SceneRecording) -> None:
        self.recording = recording
        props = Props(recording)
        mannequin = Mannequin(recording.character, recording.heights)
        self.watch = Watch(recording, props, mannequin)
        self.painter = Painter(recording, self.watch.light, props, mannequin)

    def picture(self, time: float, size: tuple[int, int], marks: bool) -> Picture:
        """The picture of one moment, as in a film."""
        frame = time * self.recording.fps
        cameras = self.watch.cameras([frame], size)
        firm = self.watch.solidity([frame], cameras)[0]
        return to_bytes(self.painter.paint(frame, cameras[0], solidity=firm, marks=marks))


def _fields(recording: SceneRecording, time: float) -> list[tuple[str, str]]:
    """The labelled values under a picture."""
    fields = [("time", f"{recording.began + time:.1f} s")]
    event = recording.event_at(time)
    return [*fields, ("now", event)] if event else fields


def _veiled(picture: Picture, title: str, fields: list[tuple[str, str]]) -> Picture:
    """`picture` paler where `caption` will write, so that words are read over any object."""
    unit = picture.shape[0] / 360.0
    words = font(15.0 * unit)
    columns = [max(words.getlength("0.00 m/s"), words.getlength(text)) for _, text in fields]
    wide = max(sum(columns) + 16.0 * unit * (len(columns) - 1), font(18.0 * unit).getlength(title))
    image = Image.fromarray(picture)
    box = (20.0 * unit, picture.shape[0] - 84.0 * unit, wide + 42.0 * unit,
           picture.shape[0] - 14.0 * unit)  # fmt: skip
    mask = Image.new("L", image.size, 0)
    ImageDraw.Draw(mask).rectangle(box, fill=VEIL)
    image.paste(PAPER, (0, 0, *image.size), mask)
    return np.array(image)


def _check_time(recording: SceneRecording, time: float) -> None:
    if not -1e-6 <= time <= recording.duration + 1e-6:
        raise ValueError(f"{time} s is outside the recording, 0 to {recording.duration:.3f} s")


def _check_span(recording: SceneRecording, start: float, stop: float | None) -> float:
    """`stop`, or the end of the recording."""
    end = recording.frames / recording.fps
    stop = end if stop is None else stop
    if not 0.0 <= start < stop <= end + 1e-6:
        raise ValueError(
            f"start and stop must lie in 0 to {end:.3f} s, the first before the second, "
            f"not {start} and {stop}"
        )
    return stop
