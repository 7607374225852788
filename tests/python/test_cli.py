"""The command line as a whole: every command's help, completion, errors."""

from __future__ import annotations

import importlib
import runpy
from collections.abc import Iterator

import click
import pytest
from click.testing import CliRunner

from ambulo.cli import cli, main


def commands(group: click.Group = cli, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    for name, command in group.commands.items():
        yield (*path, name)
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))


@pytest.mark.parametrize("path", list(commands()), ids=" ".join)
def test_help_tells_what_and_shows_how(path: tuple[str, ...]) -> None:
    run = CliRunner().invoke(cli, [*path, "--help"])
    assert run.exit_code == 0
    assert "\\b" not in run.output, "click's mark for keeping lines apart is printed"
    command: click.Command = cli
    for name in path:
        assert isinstance(command, click.Group)
        command = command.commands[name]
    if not isinstance(command, click.Group):
        examples = [line for line in run.output.splitlines() if " ambulo " in line]
        assert examples and all(line.startswith("    ") for line in examples)
        assert all(option.help for option in command.params if isinstance(option, click.Option))


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell: str) -> None:
    run = CliRunner().invoke(cli, ["completion", shell])
    assert run.exit_code == 0 and "_AMBULO_COMPLETE" in run.output


def test_errors_are_one_line_unless_debugging(tmp_path) -> None:
    broken = tmp_path / "broken.safetensors"
    broken.write_bytes(b"12345678")
    run = CliRunner().invoke(cli, ["model", "info", str(broken)])
    assert run.exit_code == 1 and run.output.count("\n") == 1 and "broken.safetensors" in run.output
    debugged = CliRunner().invoke(cli, ["--debug", "model", "info", str(broken)])
    assert isinstance(debugged.exception, ValueError)


def test_the_demo_needs_no_data(tmp_path, monkeypatch) -> None:
    """All of it but the length: less motion, hardly any training, no film."""
    monkeypatch.delenv("AMBULO_DATA", raising=False)
    # By module: `ambulo.cli` has the commands under the same names.
    monkeypatch.setattr(importlib.import_module("ambulo.cli.demo"), "MINUTES", 0.5)
    character = importlib.import_module("ambulo.cli.character")
    monkeypatch.setattr(character, "write_outputs", lambda *_: [])
    out = tmp_path / "out"
    run = CliRunner().invoke(cli, ["demo", "-o", str(out), "--steps", "3"])
    assert run.exit_code == 0, run.output
    assert "6 of 6 waypoints reached" in run.output
    assert (out / "trained.safetensors").is_file() and (out / "data" / "dataset.json").is_file()
    again = CliRunner().invoke(cli, ["demo", "-o", str(out), "--steps", "3"])
    assert again.exit_code == 0, again.output


@pytest.mark.parametrize("stopped", ["cli", "main"])
def test_ctrl_c_outside_of_a_command_is_no_traceback(
    stopped: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(**_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(f"ambulo.cli.{stopped}", stop)
    with pytest.raises(SystemExit) as caught:
        if stopped == "cli":
            main()
        else:
            runpy.run_module("ambulo", run_name="__main__")
    assert caught.value.code == 130
    assert capsys.readouterr().err == "stopped\n"
