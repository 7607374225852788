"""One look for every progress bar: share, counts, time left; on standard error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


@contextmanager
def bar(title: str, total: float, unit: str) -> Iterator[Callable[[float], None]]:
    """Show a bar while a block runs; the function it gives takes what is done so far.

    Nothing is drawn where standard error is not a terminal.
    """
    console = Console(stderr=True)
    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
    ]
    if unit:
        columns.append(TextColumn(f"{{task.completed:.1f}}/{{task.total:.0f}} {unit}"))
    columns += [TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn()]
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task(title, total=total)
        yield lambda done: progress.update(task, completed=done)
        progress.update(task, completed=total)
