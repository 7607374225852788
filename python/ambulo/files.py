"""Writing files so that nothing is half written."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to; it becomes `path` on success and goes on failure."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def write_atomic(path: str | Path, content: bytes | str) -> None:
    """Write a file so that at any moment it is either the old one or the whole new one."""
    data = content.encode() if isinstance(content, str) else content
    with replacing(Path(path)) as part, part.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
