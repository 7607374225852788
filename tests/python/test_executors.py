"""Where genomes are tried: threads, and a Ray cluster that gives the same to the last bit."""

from __future__ import annotations

import importlib.util
import json
import socket
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ambulo import executors
from ambulo._core import Arena
from ambulo.creature import load_creature
from ambulo.executors import check_ray, default_threads, on_ray, on_threads
from creature_runs import SMALL, ambulo, outcome


def arena(population: int = 10) -> Arena:
    settings = SMALL | {"evolution": {"population": population}}
    return Arena(load_creature("tetrapod1"), json.dumps(settings))


# -- threads ----------------------------------------------------------------------------------


@pytest.mark.parametrize("population", [3, 7, 8, 9, 25])
def test_scores_do_not_depend_on_threads_nor_on_who_is_beside(population: int) -> None:
    here = arena(population)
    genomes, how = here.search().ask(), here.search().round(here)
    fitness = np.array([here.score(genome)[0] for genome in genomes])
    alone = np.concatenate([here.evaluate(genome[None], 1) for genome in genomes])
    assert alone.shape == (population, 5) and alone[:, 0].tolist() == fitness.tolist()
    assert fitness.std() > 0.0 and (alone[:, 1] == 1.0).all()
    assert ((alone[:, 2:] >= 0.0) & (alone[:, 2:] <= 1.0)).all() and set(alone[:, 4]) <= {0.0, 1.0}
    for threads in (1, 2, 3, 64, None):
        assert on_threads(here, threads)(genomes, how).tolist() == alone.tolist()
    assert on_threads(here)(genomes[::-1].copy(), how).tolist() == alone[::-1].tolist()
    shorter = json.dumps(json.loads(how) | {"steps": 30})
    assert (on_threads(here)(genomes, shorter)[:, 0] != fitness).any()


def lanes_here() -> list[int]:
    """As this machine says when it is asked for a number that none has."""
    with pytest.raises(ValueError, match=r"^lanes: 3; this machine has 1(, \d+)*$") as caught:
        Arena(load_creature("tetrapod1"), json.dumps(SMALL), lanes=3)
    return [int(lanes) for lanes in str(caught.value).partition("has ")[2].split(", ")]


def test_any_number_of_lanes_gives_the_same_bits() -> None:
    body = load_creature("tetrapod1")
    settings = json.dumps({"task": {"name": "run", "steps": 90}, "evolution": {"population": 19}})
    here = Arena(body, settings)
    genomes = here.search().ask()
    expected = here.evaluate(genomes, 1)
    assert expected[:, 0].std() > 0.0
    for lanes in lanes_here():
        other = Arena(body, settings, lanes=lanes)
        assert other.evaluate(genomes, 2).tolist() == expected.tolist()
        assert other.robustness(genomes[:3], 1) == here.robustness(genomes[:3], 2)
        assert other.record(genomes[0], 90).hash == here.record(genomes[0], 90).hash


@pytest.mark.parametrize("lanes", [0, 2, 3, 1000])
def test_a_number_of_lanes_that_no_machine_has_is_refused(lanes: int) -> None:
    known = ", ".join(map(str, lanes_here()))
    with pytest.raises(ValueError, match=f"^lanes: {lanes}; this machine has {known}$"):
        Arena(load_creature("tetrapod1"), json.dumps(SMALL), lanes=lanes)


def test_all_processors_are_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    assert default_threads() >= 1
    asked: list[tuple[int, str]] = []

    class Noting:
        def try_round(self, genomes: object, how: str, threads: int) -> object:
            asked.append((threads, how))
            return genomes

    monkeypatch.setattr(executors, "default_threads", lambda: 5)
    noting: Any = Noting()
    on_threads(noting)(np.zeros((1, 1), np.float32), "first")
    on_threads(noting, 3)(np.zeros((1, 1), np.float32), "second")
    assert asked == [(5, "first"), (3, "second")]


# -- Ray, or none -----------------------------------------------------------------------------


@contextmanager
def listening() -> Iterator[int]:
    """A port at which somebody answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


def deserted() -> int:
    """A port at which nobody does."""
    with listening() as port:
        pass
    return port


def test_without_ray_it_says_how_to_get_it_and_begins_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It had begun the run before it found out, which then was in the way."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with (
        pytest.raises(RuntimeError, match=r"pip install 'ambulo\[ray\]'"),
        on_ray(load_creature("tetrapod1"), arena()),
    ):
        pass
    run = ambulo("evolve", "biped1", "run", "-o", tmp_path / "run", "--executor", "ray")
    assert run.exit_code == 1
    assert run.output == ("Error: spreading over a cluster needs Ray: pip install 'ambulo[ray]'\n")
    assert not list(tmp_path.iterdir())


def test_an_address_without_ray_is_wrong_usage(tmp_path: Path) -> None:
    run = ambulo("evolve", "biped1", "run", "-o", tmp_path / "r", "--ray-address", "auto")
    assert run.exit_code == 2 and "--ray-address belongs to --executor ray" in run.output
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("form", ["127.0.0.1:{}", "ray://127.0.0.1:{}"])
def test_an_address_at_which_nobody_answers_is_refused_at_once(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ray tries for more than three minutes, and then ends the process with code 15."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: True)
    address = form.format(deserted())
    run = ambulo(
        "evolve", "biped1", "run", "-o", tmp_path / "r", "--executor", "ray",
        "--ray-address", address,
    )  # fmt: skip
    assert run.exit_code == 1
    assert f"no Ray cluster answers at {address}: " in run.output
    assert not list(tmp_path.iterdir())
    with pytest.raises(ConnectionError, match="no Ray cluster answers"):
        check_ray("127.0.0.1:123456")
    with listening() as port:
        check_ray(form.format(port))
    check_ray("auto")


# In a process of its own, because Ray leaves threads behind and forks.
SCRIPT = """
import json
import subprocess
import sys

import numpy as np
import ray
from click.testing import CliRunner

from ambulo import executors
from ambulo._core import Arena
from ambulo.cli import cli
from ambulo.creature import load_creature

settings, config, folder = sys.argv[1:]
executors.default_threads = lambda: 2
creature = load_creature("tetrapod1")
arena = Arena(creature, settings)
genomes = arena.search().ask()
how = arena.search().round(arena)
short = json.dumps(json.loads(how) | {"steps": 30})
command = ["evolve", "biped1", "run", "--config", config, "--executor", "ray", "-o"]
with executors.on_ray(creature, arena) as tried:
    workers = ray.cluster_resources()["CPU"]
    spread = [tried(genomes, how).tolist(), tried(genomes[:1], short).tolist()]
    # One cluster for all who want one: this does not end it.
    inside = CliRunner().invoke(cli, [*command, folder + "/inside"])
    still = ray.is_initialized() and tried(genomes[:1], short).tolist() == spread[1]
    address = ray.get_runtime_context().gcs_address
    outside = subprocess.run(
        [sys.executable, "-m", "ambulo", *command, folder + "/outside", "--ray-address", address],
        capture_output=True, text=True,
    )
on_threads = executors.on_threads(arena, 2)
threads = [on_threads(genomes, how).tolist(), on_threads(genomes[:1], short).tolist()]
print(json.dumps({
    "workers": workers, "spread": spread, "threads": threads, "still": still,
    "inside": [inside.exit_code, inside.output],
    "outside": [outside.returncode, outside.stdout + outside.stderr],
    "over": not ray.is_initialized(),
}))
"""


@pytest.fixture(scope="module")
def with_ray(
    tmp_path_factory: pytest.TempPathFactory, small_config: Path
) -> tuple[Path, dict[str, Any]]:
    """What came of a local cluster of two workers, and the folder of its runs."""
    if importlib.util.find_spec("ray") is None:
        pytest.skip("no Ray: pip install 'ambulo[ray]'")
    folder = tmp_path_factory.mktemp("ray")
    run = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(SCRIPT), arena().settings(), small_config, folder],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    return folder, json.loads(run.stdout.splitlines()[-1])


def test_a_cluster_gives_the_same_scores_to_the_last_bit(
    with_ray: tuple[Path, dict[str, Any]],
) -> None:
    _, found = with_ray
    assert found["workers"] == 2 and len(found["threads"][0]) == 10
    assert found["spread"] == found["threads"]


def test_a_cluster_that_was_there_stays_and_our_own_ends(
    with_ray: tuple[Path, dict[str, Any]],
) -> None:
    _, found = with_ray
    assert found["still"] and found["over"]


@pytest.mark.parametrize("place", ["inside", "outside"])
def test_a_run_on_a_cluster_is_the_run_on_threads(
    place: str, with_ray: tuple[Path, dict[str, Any]], finished_run: Path
) -> None:
    folder, found = with_ray
    code, said = found[place]
    assert code == 0, said
    assert outcome(folder / place) == outcome(finished_run)
