"""Pictures and films of a recording, drawn from plain arrays."""

from ambulo.pictures.film import Shot, write_film, write_filmstrip
from ambulo.pictures.top_view import write_top_view

__all__ = ["Shot", "write_film", "write_filmstrip", "write_top_view"]
