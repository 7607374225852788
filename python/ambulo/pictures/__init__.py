"""Pictures and films of a recording, on its own or in a scene, drawn from plain arrays."""

from ambulo.pictures.film import Shot, write_film, write_filmstrip
from ambulo.pictures.scene import (
    draw_scene,
    write_scene_film,
    write_scene_plan,
    write_scene_strip,
)
from ambulo.pictures.top_view import write_top_view

__all__ = [
    "Shot",
    "draw_scene",
    "write_film",
    "write_filmstrip",
    "write_scene_film",
    "write_scene_plan",
    "write_scene_strip",
    "write_top_view",
]
