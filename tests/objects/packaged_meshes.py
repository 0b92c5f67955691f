"""Watertight meshes that other packages ship: scans, CAD parts, robots' links, toys."""

import importlib.util
from pathlib import Path

import pytest
import trimesh

CLEAN = (
    "pymeshlab/tests/sample_meshes/airplane.obj",
    "pymeshlab/tests/sample_meshes/bone.ply",
    "pymeshlab/tests/sample_meshes/bunny.obj",
    "pymeshlab/tests/sample_meshes/cube.obj",
    "pybullet_data/a1/meshes/hip.obj",
    "pybullet_data/bicycle/files/wheel_axels.stl",
    "pybullet_data/bunny.obj",
    "pybullet_data/differential/diff_motor_cover.stl",
    "pybullet_data/domino/domino.obj",
    "pybullet_data/duck_vhacd.obj",
    "pybullet_data/franka_panda/meshes/collision/hand.obj",
    "pybullet_data/gripper/meshes/WSG50_110.stl",
    "pybullet_data/laikago/lower_leg3.obj",
    "pybullet_data/quadruped/microtaur/fr12_h101.stl",
    "pybullet_data/racecar/meshes/left_front_wheel.STL",
    "pybullet_data/random_urdfs/000/000.obj",
    "pybullet_data/random_urdfs/500/500.obj",
    "pybullet_data/soccerball.obj",
    "pybullet_data/torus/torus_textured.obj",
    "pybullet_data/toys/concave_box.obj",
    "pybullet_data/toys/shape_sorter.obj",
    "dm_robotics/manipulation/standard_cell/rgb_basket_assets/lasercut_basket_part_1__2default.stl",
    "mujoco/mjx/test_data/meshes/dodecahedron.stl",
    "mujoco/mjx/test_data/barkour_v0/assets/foot.stl",
    "mujoco/mjx/test_data/shadow_hand/assets/f_knuckle.obj",
    "mujoco/mjx/test_data/shadow_hand/assets/lf_metacarpal.obj",
    "mujoco/mjx/test_data/shadow_hand/assets/mounting_plate.obj",
    "mujoco/mjx/test_data/shadow_hand/assets/th_middle.obj",
)
# faces that pass through each other: in a place too small to matter, and in larger ones
SCRATCHED = (
    "pymeshlab/tests/sample_meshes/cow.obj",
    "pybullet_data/duck.obj",
    "pybullet_data/franka_panda/meshes/visual/finger.obj",
    "pybullet_data/teddy2_VHACD_CHs.obj",
)
CROSSED = (
    "pybullet_data/aliengo/meshes/calf.obj",
    "pybullet_data/tray/tray_textured.obj",
    "pybullet_data/xarm/xarm_gripper/meshes/left_inner_knuckle.STL",
)


def packaged_mesh(name):
    """Loads a mesh of an installed package; skips the test without it."""
    package, _, path = name.partition("/")
    spec = importlib.util.find_spec(package)
    folders = (spec and spec.submodule_search_locations) or []
    file = next((Path(f) / path for f in folders if (Path(f) / path).exists()), None)
    if file is None:
        pytest.skip(f"{package} is not installed, or has no such mesh")
    mesh = trimesh.load(file, force="mesh")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    assert mesh.is_watertight and mesh.volume > 0.0
    return mesh
