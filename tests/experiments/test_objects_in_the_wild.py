"""What the script makes of a folder with one file of each outcome."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

SCRIPT = Path(__file__).parents[2] / "experiments" / "objects_in_the_wild.py"
LINK = (
    '<link name="{}"><inertial><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" '
    'iyz="0" izz="0.02"/></inertial><visual><geometry><box size="0.2 0.2 0.2"/></geometry>'
    "</visual></link>"
)
HINGE = '<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint>'
BODY = (
    '<mujoco><worldbody><body pos="0.1 0 0" euler="0 0 30"><geom type="box" size="0.1 0.2 0.1"/>'
    '<body pos="0.2 0 0"><geom size="0.1"/></body></body></worldbody></mujoco>'
)


@pytest.mark.long
def test_each_outcome(tmp_path):
    files = tmp_path / "files"
    files.mkdir()
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    box.export(files / "box.stl")
    box.export(files / "the_same.stl")
    box.update_faces(np.arange(12) != 3)
    box.export(files / "open.obj")
    (files / "block.urdf").write_text(f'<robot name="r">{LINK.format("a")}</robot>')
    arm = LINK.format("a") + LINK.format("b") + HINGE
    (files / "arm.urdf").write_text(f'<robot name="r">{arm}</robot>')
    (files / "body.xml").write_text(BODY)
    (files / "package.xml").write_text("<package/>")
    command = [sys.executable, str(SCRIPT), f"root={files}", "hydra.run.dir=run"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    result = json.loads(done.stdout.splitlines()[-1])
    assert result["outcomes"] == {"right": 3, "refused": 2}
    assert result["refused"] == {"a joint that moves": 1, "no solid": 1}
    with (tmp_path / "run" / "files.csv").open(newline="") as stream:
        rows = {Path(row["file"]).name: row for row in csv.DictReader(stream)}
    assert set(rows) == {"box.stl", "open.obj", "block.urdf", "arm.urdf", "body.xml"}
    assert all(float(r["difference"]) < 1e-5 for r in rows.values() if r["outcome"] == "right")
