"""`python -m mjx_inertia.space`: what it prints and writes, and what it refuses."""

import subprocess
import sys

import numpy as np
import pytest

from mjx_inertia import runtime
from mjx_inertia.space.__main__ import main


def command(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "mjx_inertia.space", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow  # the notebook of this package runs the same in the test line
def test_the_command_searches_and_draws(tmp_path):
    costs = ("--objectives", "object_force", "object_moment", "base_turn")
    run = command("--generations", "3", "--out", str(tmp_path / "new"), "--no-arrive", *costs)
    assert run.returncode == 0, run.stderr
    assert "worst share of the straight quintic" in run.stdout and "base_turn_z" in run.stdout
    names = {file.name for file in (tmp_path / "new").iterdir()}
    assert names == {"front.npz", "front.svg", "parallel.svg", "path.svg", "manoeuvre.gif"}
    with np.load(tmp_path / "new" / "front.npz") as front:
        assert front["decisions"].shape[1] == 6 and front["costs"].shape[1] == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--objectives", "force", "force"], "expected each once"),
        (["--seed", "99999999999999999999"], "expected a number from 0"),
        (["--target", "0", "2.2", "0"], "nothing to do"),
        (["--target", "0", "9", "0"], "out of reach, or not found"),
        (["--mass", "0"], "`object_mass` is 0.0"),
        (["--generations", "0"], "expected 1 or more"),
        (["--link-inertia", "round"], "`link_inertia` is 'round'"),
    ],
)
def test_errors_are_one_line(arguments, words, tmp_path, capsys, monkeypatch):
    # devices and precision are those of this process already
    monkeypatch.setattr(runtime, "configure", lambda **settings: None)
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.long  # a process
def test_the_process_ends_with_that_line(tmp_path):
    run = command("--generations", "0", "--out", str(tmp_path / "out"))
    assert run.returncode == 2
    assert "expected 1 or more" in run.stderr and run.stderr.count("\n") == 1
