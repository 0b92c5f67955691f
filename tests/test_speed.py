"""The script that runs all benchmarks: its table, its JSON line, a benchmark that fails."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "experiments" / "speed.py"
# what each benchmark prints last, as far as it is read
LINES = {
    "throughput.py": {"ratio": 6.5, "pushes_per_s": 1300.0, "rival_pushes_per_s": 200.0},
    "sysid_rival.py": {"ratio": 21.0, "ours_pushes_per_s": 42.0, "rival_pushes_per_s": 2.0},
    "grasp_speed.py": {
        "ratio": 8.0, "ours_s": 0.2, "rival_s": 1.6, "planning_s": 2.0, "planning_compile_s": 15.0,
    },
    "space_speed.py": {
        "ratio_same_nodes_alone": 31.0, "ours_alone_evaluations_per_s": 31_000.0,
        "rival_same_nodes_alone_evaluations_per_s": 1000.0,
    },
    "mass_properties.py": {"ratio": 12.0, "ours_meshes_per_s": 12e3, "trimesh_meshes_per_s": 1e3},
}  # fmt: skip


def run(monkeypatch, run_script, *arguments, failing=()):
    """The script with benchmarks that only print, and its exit status."""
    real = subprocess.run

    def only_print(command, *rest, **options):
        if command[0] != sys.executable:
            return real(command, *rest, **options)
        name = Path(command[1]).name
        printed = f"words\n{json.dumps({**LINES[name], 'compile_s': 5.0})}\n"
        return subprocess.CompletedProcess(command, int(name in failing), printed)

    monkeypatch.setattr("subprocess.run", only_print)
    return run_script(SCRIPT, *arguments)[0]


def test_all_ratios_stand_in_the_last_line(monkeypatch, run_script, capsys):
    assert run(monkeypatch, run_script) == 0
    lines = capsys.readouterr().out.splitlines()
    assert json.loads(lines[-1]) == {
        "throughput_ratio": 6.5, "sysid_ratio": 21.0, "grasp_ratio": 8.0, "space_ratio": 31.0,
        "mass_properties_ratio": 12.0, "planning_s": 2.2,
    }  # fmt: skip
    assert sum(line.startswith("| ") for line in lines) == 1 + 1 + 5 + 1  # head, rule, rows, plan
    row = "| identified pushes | 42.0 pushes/s | mujoco.sysid: 2.00 pushes/s | 21.0 | 5.0 s |"
    assert row in lines


def test_a_benchmark_that_fails_leaves_the_others(monkeypatch, run_script, capsys):
    assert run(monkeypatch, run_script, failing=("grasp_speed.py",)) == 1
    headline = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert headline["grasp_ratio"] is None and headline["planning_s"] is None
    assert headline["space_ratio"] == 31.0


def test_unknown_parts_are_refused(monkeypatch, run_script):
    assert "parts=['speed']" in run(monkeypatch, run_script, "parts=speed")


def test_every_benchmark_is_a_script():
    assert all((SCRIPT.parent / name).exists() for name in LINES)
