"""The scene and the interactions that ship are good by the schemas that editors check them with."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

ROOT = Path(__file__).parents[2]
SCHEMAS = {
    name: json.loads((ROOT / "schema" / f"{name}.schema.json").read_text(encoding="utf-8"))
    for name in ("interaction", "scene", "script")
}
FILES = [
    *(("interaction", path) for path in sorted((ROOT / "starters/interactions").glob("*.toml"))),
    *(
        ("script" if path.stem.endswith("-visit") else "scene", path)
        for path in sorted((ROOT / "starters/scenes").glob("*.toml"))
    ),
]


@pytest.mark.parametrize("name", SCHEMAS)
def test_the_schemas_are_some(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMAS[name])


@pytest.mark.parametrize(("name", "path"), FILES, ids=lambda value: getattr(value, "stem", value))
def test_what_ships_is_good_by_the_schema(name: str, path: Path) -> None:
    jsonschema.validate(tomllib.loads(path.read_text(encoding="utf-8")), SCHEMAS[name])


def test_an_unknown_field_is_not() -> None:
    path = ROOT / "starters/interactions/sit.toml"
    interaction = tomllib.loads(path.read_text(encoding="utf-8"))
    interaction["clip"]["speed"] = 2
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(interaction, SCHEMAS["interaction"])
