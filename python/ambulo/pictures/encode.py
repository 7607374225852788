"""Film files: GIF by Pillow, MP4 by an ffmpeg on the PATH, and whole files or none."""

from __future__ import annotations

import io
import shutil
import struct
import subprocess
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ambulo.files import replacing

Picture = NDArray[np.uint8]

CLEAR = 255  # the palette index that means "as before"
TOLERANCE = 3  # of 255: a pixel that changed by less keeps the colour it shows


class Film(Protocol):
    """A film being written."""

    def write(self, picture: Picture) -> None:
        """Appends one picture (H, W, 3)."""
        ...


@contextmanager
def open_film(
    part: Path,
    suffix: str,
    size: tuple[int, int],
    fps: int,
    samples: Callable[[], Iterable[Picture]],
) -> Iterator[Film]:
    """A film of kind `suffix` to be written to `part`; `samples()` are some of its pictures."""
    if suffix.lower() == ".gif":
        if 100 % fps:
            raise ValueError(f"a GIF counts hundredths of a second: fps must divide 100, not {fps}")
        palette = shared_palette(samples())
        with part.open("wb") as file:
            gif = GifFilm(file, palette, size, 100 // fps)
            yield gif
            gif.close()
    elif suffix.lower() == ".mp4":
        with _mp4(part, size, fps) as film:
            yield film
    else:
        raise ValueError(f"a film's name must end in .gif or .mp4, not {suffix!r}")


def write_pictures(
    path: Path,
    count: int,
    paint: Callable[[int], Picture],
    *,
    size: tuple[int, int],
    fps: int,
    progress: Callable[[int, int], object] | None,
) -> Path:
    """Writes the film of `count` pictures that `paint` paints by index, whole or not at all."""
    sample = np.linspace(0, count - 1, min(count, 12)).astype(int).tolist()
    with (
        replacing(path) as part,
        open_film(part, path.suffix, size, fps, lambda: map(paint, sample)) as film,
    ):
        for k in range(count):
            film.write(paint(k))
            if progress is not None:
                progress(k + 1, count)
    return path


# GIF ----------------------------------------------------------------------------------------


def shared_palette(pictures: Iterable[Picture]) -> Image.Image:
    """One palette of 255 colours for all `pictures`; index 255 stays free for "as before".

    A median cut by pixel count would spend itself on ground and sky, so the pixels are thinned:
    every colour cell of 4 x 4 x 4 counts by the square root of its pixels.
    """
    pixels = np.concatenate([p[::2, ::2].reshape(-1, 3) for p in pictures])
    keys = (pixels >> 2).astype(np.int64) @ np.array([4096, 64, 1])
    _, first, counts = np.unique(keys, return_index=True, return_counts=True)
    # Cells of a single pixel are mostly edges, which their neighbours serve well enough.
    weights = np.sqrt(counts).astype(np.int64)
    flat = np.repeat(pixels[first], weights, axis=0)
    flat = np.resize(flat, (-(-len(flat) // 64) * 64, 3))  # a whole number of rows
    image = Image.fromarray(np.ascontiguousarray(flat.reshape(-1, 64, 3)))
    found = image.quantize(CLEAR, Image.Quantize.MEDIANCUT, kmeans=2).getpalette() or []
    colours = (found + [0] * (3 * CLEAR))[: 3 * CLEAR]
    holder = Image.new("P", (1, 1))
    holder.putpalette(colours + colours[-3:])
    return holder


class GifFilm:
    """Writes an endless GIF picture by picture, each as the change from the one before.

    Pillow packs the pixels; the container is written here, so that a long film is never held in
    memory and every picture uses the one palette.
    """

    def __init__(
        self, file: BinaryIO, palette: Image.Image, size: tuple[int, int], delay: int
    ) -> None:
        """`delay` in hundredths of a second."""
        self.file, self.palette, self.delay = file, palette, delay
        self.colours = np.array((palette.getpalette() or [])[:768], np.uint8).reshape(-1, 3)
        self.shown: Picture | None = None
        file.write(b"GIF89a" + struct.pack("<HHBBB", *size, 0xF7, 0, 0))
        file.write(self.colours.tobytes())
        file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")

    def write(self, picture: Picture) -> None:
        """Appends one picture (H, W, 3)."""
        image = Image.fromarray(picture)
        index = np.array(image.quantize(palette=self.palette, dither=Image.Dither.NONE))
        index[index == CLEAR] = CLEAR - 1  # the free slot repeats this colour
        left, top = 0, 0
        if self.shown is None:
            self.shown = self.colours[index]
        else:
            change = np.abs(picture.astype(np.int16) - self.shown).max(-1) > TOLERANCE
            change &= (self.colours[index] != self.shown).any(-1)
            self.shown[change] = self.colours[index[change]]
            index[~change] = CLEAR
            rows, columns = np.flatnonzero(change.any(1)), np.flatnonzero(change.any(0))
            if len(rows):
                left, top = int(columns[0]), int(rows[0])
                index = index[top : rows[-1] + 1, left : columns[-1] + 1]
            else:
                index = index[:1, :1]
        self.file.write(b"\x21\xf9\x04" + struct.pack("<BHBB", 0b101, self.delay, CLEAR, 0))
        self.file.write(_packed(index, self.colours, left, top))

    def close(self) -> None:
        """Ends the file."""
        self.file.write(b";")


def _packed(index: NDArray[np.uint8], colours: Picture, left: int, top: int) -> bytes:
    """Image descriptor and packed pixels of `index` (h, w), taken from a one-picture GIF."""
    image = Image.fromarray(np.ascontiguousarray(index))
    image = _with_palette(image, colours)
    buffer = io.BytesIO()
    image.save(buffer, "GIF", optimize=False, interlace=0)
    data = buffer.getvalue()
    at = 13 + (3 << ((data[10] & 7) + 1) if data[10] & 0x80 else 0)
    while data[at] == 0x21:  # extensions: skip their blocks
        at += 2
        while data[at]:
            at += data[at] + 1
        at += 1
    height, width = index.shape
    return struct.pack("<BHHHHB", 0x2C, left, top, width, height, 0) + data[at + 10 : -1]


def _with_palette(image: Image.Image, colours: Picture) -> Image.Image:
    """A palette picture with the indices of the grey picture `image`."""
    out = Image.frombytes("P", image.size, image.tobytes())
    out.putpalette(colours.tobytes())
    return out


# MP4 ----------------------------------------------------------------------------------------


class _PipeFilm:
    def __init__(self, pipe: BinaryIO) -> None:
        self.pipe = pipe

    def write(self, picture: Picture) -> None:
        self.pipe.write(np.ascontiguousarray(picture).tobytes())


@contextmanager
def _mp4(part: Path, size: tuple[int, int], fps: int) -> Iterator[Film]:
    """Pictures piped raw into ffmpeg."""
    if size[0] % 2 or size[1] % 2:
        raise ValueError(f"an MP4 needs an even width and height, not {size[0]} x {size[1]}")
    tool = shutil.which("ffmpeg")
    if tool is None:
        raise RuntimeError("an MP4 needs ffmpeg on the PATH, and there is none; write a .gif")
    listed = subprocess.run([tool, "-hide_banner", "-encoders"], capture_output=True, text=True)
    codec = ["libx264", "-crf", "20"] if "libx264" in listed.stdout else ["mpeg4", "-q:v", "3"]
    command = [tool, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{size[0]}x{size[1]}", "-r", str(fps), "-i", "-", "-an", "-c:v", *codec]
    command += ["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(part)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdin is not None and process.stderr is not None
    try:
        yield _PipeFilm(process.stdin)  # type: ignore[arg-type]
        process.stdin.close()
        message = process.stderr.read().decode(errors="replace").strip()
        if process.wait():
            raise RuntimeError(f"ffmpeg failed: {message or process.returncode}")
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        process.stderr.close()
