"""tools/check-rooms, run on a small checkout in which each kind of violation is planted."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

CHECKER = Path(__file__).parents[2] / "tools" / "check-rooms"

BOOK = """\
# Architecture

```rooms
crates/rig            → —              # bones
crates/net            → —
crates/motion/formats → rig
crates/motion/control → rig, net   (tests: formats)
crates/creature/body  → —
bindings/python       → *
python/ambulo         → bindings/python
```

```planned
crates/host           → control
studio                → —
```

```strangers
net                                  ↛ rig, crates/motion/*
control                              ↛ formats
crates/motion/*                      ↛ crates/creature/*
```

```imports
ambulo.models (planned)              ↛ ambulo.*
ambulo.film                          ↛ ambulo._core
ambulo.*                             ↛ ambulo.cli
```
"""


class Checkout:
    """A small workspace as the book above draws it, and the checker to run on it."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.write("ARCHITECTURE.md", BOOK)
        self.write(
            "Cargo.toml",
            '[workspace]\nresolver = "3"\n'
            'members = ["crates/*", "crates/motion/*", "crates/creature/*", "bindings/python"]\n'
            'exclude = ["crates/motion", "crates/creature", "fuzz"]\n',
        )
        self.crate("crates/rig")
        self.crate("crates/net")
        self.crate("crates/motion/formats", uses=["crates/rig"])
        self.crate("crates/motion/control", uses=["crates/rig", "crates/net"])
        self.crate("crates/creature/body")
        self.crate("bindings/python", uses=["crates/motion/control", "crates/motion/formats"])
        self.write("python/ambulo/__init__.py", "")
        self.write("python/ambulo/__main__.py", "from ambulo.cli import main\nmain()\n")
        self.write("python/ambulo/_core.pyi", "")
        self.write("python/ambulo/cli.py", "import ambulo.film\nimport ambulo.motion\n")
        self.write("python/ambulo/film.py", "import json\n")
        self.write("python/ambulo/motion.py", "from ambulo import _core\n")

    def write(self, path: str, text: str) -> None:
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")

    def edit(self, path: str, old: str, new: str) -> None:
        text = (self.root / path).read_text(encoding="utf-8")
        assert old in text
        self.write(path, text.replace(old, new))

    def crate(
        self, folder: str, *, uses: list[str] | None = None, kind: str = "dependencies"
    ) -> None:
        up = "../" * (folder.count("/") + 1)
        lines = [f'{name(used)} = {{ path = "{up}{used}" }}' for used in uses or []]
        self.write(
            f"{folder}/Cargo.toml",
            f'[package]\nname = "{name(folder)}"\nversion = "0.1.0"\nedition = "2024"\n\n'
            f"[{kind}]\n" + "\n".join(lines) + "\n",
        )
        self.write(f"{folder}/src/lib.rs", "")

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, str(CHECKER), "--root", str(self.root), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=120)

    def violations(self, *arguments: str) -> list[str]:
        """Return the messages; a violation without exit status 1 is an error of its own."""
        result = self.run("--json", *arguments)
        assert result.returncode in (0, 1), result.stderr
        report = json.loads(result.stdout)
        assert report["ok"] == (result.returncode == 0) == (not report["violations"])
        return [violation["message"] for violation in report["violations"]]


def name(folder: str) -> str:
    return "mini-" + folder.rsplit("/", 1)[-1]


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    return Checkout(tmp_path)


def test_what_is_as_drawn_passes(checkout: Checkout) -> None:
    result = checkout.run()
    assert (result.stdout, result.returncode) == ("7 rooms, all as drawn\n", 0), result.stderr


def test_this_repository_reads_its_own_book() -> None:
    result = subprocess.run([sys.executable, str(CHECKER), "--json"], capture_output=True)
    assert result.returncode in (0, 1), result.stderr
    assert "crates/rig" in json.loads(result.stdout)["rooms"]


def test_a_dependency_without_an_arrow(checkout: Checkout) -> None:
    checkout.crate("crates/motion/formats", uses=["crates/rig", "crates/net"])
    result = checkout.run("--no-python")
    assert result.returncode == 1
    assert result.stdout.splitlines() == [
        "crates/motion/formats/Cargo.toml:8: crates/motion/formats -> crates/net is not allowed "
        "(ARCHITECTURE.md:6: crates/motion/formats → rig)",
        "7 rooms, 1 violation",
    ]


def test_a_build_dependency_counts_as_a_dependency(checkout: Checkout) -> None:
    checkout.crate("crates/creature/body", uses=["crates/rig"], kind="build-dependencies")
    [message] = checkout.violations("--no-python")
    assert "crates/creature/body -> crates/rig is not allowed (" in message


def test_a_dependency_for_one_platform_counts(checkout: Checkout) -> None:
    checkout.crate(
        "crates/creature/body", uses=["crates/rig"], kind="target.'cfg(windows)'.dependencies"
    )
    [message] = checkout.violations("--no-python")
    assert "crates/creature/body -> crates/rig is not allowed (" in message


def test_a_renamed_dependency_is_still_found(checkout: Checkout) -> None:
    checkout.edit(
        "crates/creature/body/Cargo.toml",
        "[dependencies]\n",
        '[dependencies]\nx = { package = "mini-rig", path = "../../rig" }\n',
    )
    [message] = checkout.violations("--no-python")
    assert message.startswith(
        "crates/creature/body/Cargo.toml:7: crates/creature/body -> crates/rig "
    )


def test_tests_may_use_their_own_list_and_no_more(checkout: Checkout) -> None:
    manifest = "crates/motion/control/Cargo.toml"
    allowed = '[dev-dependencies]\nmini-formats = { path = "../formats" }\n'
    checkout.edit(manifest, "[dependencies]\n", allowed + "[dependencies]\n")
    assert checkout.violations("--no-python") == []
    body = 'mini-body = { path = "../../creature/body" }\n'
    checkout.edit(manifest, "[dev-dependencies]\n", "[dev-dependencies]\n" + body)
    [message] = checkout.violations("--no-python")
    assert "crates/motion/control -> crates/creature/body is not allowed for tests (" in message


def test_the_list_for_tests_does_not_serve_the_crate(checkout: Checkout) -> None:
    checkout.edit("ARCHITECTURE.md", "control                              ↛ formats\n", "")
    checkout.crate("crates/motion/control", uses=["crates/motion/formats"])
    [message] = checkout.violations("--no-python")
    assert "crates/motion/control -> crates/motion/formats is not allowed (" in message


def test_strangers_are_found_along_a_chain_of_allowed_steps(checkout: Checkout) -> None:
    checkout.edit("ARCHITECTURE.md", "crates/rig            → —", "crates/rig            → body")
    checkout.crate("crates/rig", uses=["crates/creature/body"])
    messages = checkout.violations("--no-python")
    assert messages == [
        f"crates/motion/{room} must not know crates/creature/body "
        "(ARCHITECTURE.md:21: crates/motion/* ↛ crates/creature/*); "
        f"chain: crates/motion/{room} -> crates/rig -> crates/creature/body"
        for room in ("control", "formats")
    ]


def test_strangers_may_meet_in_tests(checkout: Checkout) -> None:
    checkout.crate("crates/motion/control", uses=["crates/motion/formats"], kind="dev-dependencies")
    assert checkout.violations("--no-python") == []


def test_a_crate_that_is_no_room(checkout: Checkout) -> None:
    checkout.crate("crates/motion/extra")
    messages = checkout.violations("--no-python")
    assert messages == [
        "crates/motion/extra is a crate, but no room of ARCHITECTURE.md has that name"
    ]


def test_a_workspace_of_its_own_is_held_to_the_arrows_too(checkout: Checkout) -> None:
    checkout.crate("fuzz", uses=["crates/rig", "crates/net"])
    checkout.edit("fuzz/Cargo.toml", "[package]", "[workspace]\n\n[package]")
    checkout.edit("ARCHITECTURE.md", "bindings/python       → *", "fuzz → rig\nbindings/python → *")
    [message] = checkout.violations("--no-python")
    assert "fuzz -> crates/net is not allowed (" in message


def test_a_room_without_a_folder(checkout: Checkout) -> None:
    checkout.edit("ARCHITECTURE.md", "bindings/python ", "docs → —\nbindings/python ")
    messages = checkout.violations("--no-python")
    assert messages == ["docs is listed (ARCHITECTURE.md:9), but there is no such folder"]


def test_a_planned_room_moves_up_when_it_is_built(checkout: Checkout) -> None:
    checkout.crate("crates/host", uses=["crates/motion/control"])
    messages = checkout.violations("--no-python")
    assert messages == ["crates/host exists, but ARCHITECTURE.md:14 still calls it planned"]


def test_a_forbidden_import_is_found_along_its_chain(checkout: Checkout) -> None:
    checkout.write("python/ambulo/film.py", "\nfrom ambulo.motion import anything\n")
    messages = checkout.violations()
    assert messages == [
        "ambulo.film must not import ambulo._core "
        "(ARCHITECTURE.md:26: ambulo.film ↛ ambulo._core); "
        "chain: ambulo.film -> ambulo.motion (l.2), ambulo.motion -> ambulo._core (l.1)"
    ]


@pytest.mark.parametrize("module", ["__init__", "motion", "inner/deep"])
def test_nothing_imports_the_command_line(checkout: Checkout, module: str) -> None:
    checkout.write(f"python/ambulo/{module}.py", "from ambulo import cli\n")
    messages = checkout.violations()
    dotted = f"ambulo.{module}".replace("/", ".").removesuffix(".__init__")
    assert f"{dotted} must not import ambulo.cli (" in messages[0]


def test_an_import_inside_a_function_counts(checkout: Checkout) -> None:
    checkout.write("python/ambulo/film.py", "def late():\n    import ambulo._core\n")
    [message] = checkout.violations()
    assert "chain: ambulo.film -> ambulo._core (l.2)" in message


def test_models_import_nothing_of_ours_once_they_exist(checkout: Checkout) -> None:
    checkout.write("python/ambulo/models/__init__.py", "")
    checkout.write("python/ambulo/models/pfnn.py", "from ambulo.film import json\n")
    messages = checkout.violations()
    assert messages[0] == "ARCHITECTURE.md:25: ambulo.models exists: take `(planned)` away"
    assert any("ambulo.models.pfnn must not import ambulo.film (" in text for text in messages)


def test_a_rule_about_a_module_that_is_gone(checkout: Checkout) -> None:
    (checkout.root / "python/ambulo/film.py").rename(checkout.root / "python/ambulo/movie.py")
    checkout.write("python/ambulo/cli.py", "")
    messages = checkout.violations()
    assert messages == [
        "ARCHITECTURE.md:26: no module ambulo.film nor a stub of it: mark it `(planned)`?"
    ]


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("→ rig, net ", "→ rig, nett ", "ARCHITECTURE.md:7: no room is called 'nett'"),
        ("crates/rig            →", "crates/rig uses", "ARCHITECTURE.md:4: expected `ROOM → ROOM"),
        (
            "crates/rig            →",
            "crates/net →",
            "ARCHITECTURE.md:5: crates/net is listed twice",
        ),
        ("studio ", "extra/net ", "'net' may be crates/net or extra/net"),
        ("↛ formats", "formats", "ARCHITECTURE.md:20: expected `NAMES ↛ NAMES`"),
        ("```rooms", "```houses", "ARCHITECTURE.md has no fenced block ```rooms"),
        ("```planned", "```rooms", "ARCHITECTURE.md:13: a second block 'rooms'"),
    ],
)
def test_a_book_that_cannot_be_read(checkout: Checkout, old: str, new: str, complaint: str) -> None:
    checkout.edit("ARCHITECTURE.md", old, new)
    result = checkout.run("--no-python")
    assert result.returncode == 2
    assert complaint in result.stderr
    assert result.stdout == ""


def test_no_book(checkout: Checkout) -> None:
    (checkout.root / "ARCHITECTURE.md").unlink()
    result = checkout.run("--json")
    assert result.returncode == 2
    assert "cannot read" in json.loads(result.stdout)["error"]


def test_a_manifest_that_cargo_refuses(checkout: Checkout) -> None:
    checkout.edit("crates/net/Cargo.toml", "[dependencies]", "[dependencies")
    result = checkout.run("--no-python")
    assert result.returncode == 2
    assert "cargo cannot read" in result.stderr


def test_python_that_does_not_parse(checkout: Checkout) -> None:
    checkout.write("python/ambulo/motion.py", "def :\n")
    result = checkout.run()
    assert result.returncode == 2
    assert "import-linter failed" in result.stderr


def test_help_shows_examples() -> None:
    result = subprocess.run(
        [sys.executable, str(CHECKER), "--help"], capture_output=True, text=True
    )
    assert result.returncode == 0
    assert "tools/check-rooms --json" in result.stdout
