"""Scenes of objects that are no boxes: hulls from convex solids, feet where the object stands."""

import mujoco
import numpy as np
import pytest
import shapely
import trimesh

from mjx_inertia.objects import (
    Part,
    friction_radius,
    from_parts,
    load_catalogue,
    load_mcube_objects,
)
from mjx_inertia.pushing import (
    SceneSettings,
    object_parameters,
    plan_polygons,
    scene as scene_module,
)
from mjx_inertia.pushing.scene import build_spec


def compiled(obj, table):
    return build_spec(obj, SceneSettings(table=table)).compile()


def feet(model):
    names = [model.geom(i).name for i in range(model.ngeom)]
    return [name for name in names if name.startswith("foot")]


def hulls(model, prefix):
    """Vertices of the meshes whose geoms have names with a prefix, in the object frame."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = []
    for i in range(model.ngeom):
        if model.geom(i).name.startswith(prefix):
            mesh = model.geom_dataid[i]
            start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            local = model.mesh_vert[start : start + count]
            found.append(local @ data.geom_xmat[i].reshape(3, 3).T + data.geom_xpos[i])
    return found


@pytest.mark.parametrize("name", ["saucepan", "tank", "rock", "car_on_wheels", "torus", "vase"])
def test_on_its_corners_a_solid_meets_the_table_with_its_hull_and_the_tip_with_pieces(name):
    """The tip finds at its height what the object has there, from every side."""
    obj = load_catalogue(name)[name]
    model = compiled(obj, "corners")
    settings = SceneSettings()
    corners = np.concatenate(obj.pieces)
    (base,) = hulls(model, "base") or hulls(model, "hull")
    for bound in (np.min, np.max):
        np.testing.assert_allclose(bound(base, axis=0), bound(corners, axis=0), atol=1e-5)
    floor = [model.pair(i).name for i in range(model.npair) if "floor" in model.pair(i).name]
    assert floor == ["floor0"]
    pieces = hulls(model, "hull")
    height = min(settings.tip_height, obj.height / 2)
    seen = shapely.union_all(
        [shapely.Polygon(p) for p in plan_polygons(obj, height, settings.tip_radius)]
    )
    shown = shapely.union_all([shapely.MultiPoint(p[:, :2]).convex_hull for p in pieces])
    # pieces may lean beyond the slab, and no tip comes into a hole; they cover all else
    parts = shapely.get_parts(shown.buffer(2e-3))
    filled = shapely.union_all([shapely.Polygon(part.exterior) for part in parts])
    assert seen.difference(filled).area < 1e-3 * seen.area


def test_a_prism_is_extruded_as_before():
    """The hull of a flat object holds its outline at the base and at the top."""
    obj = load_mcube_objects()["tri1"]
    model = compiled(obj, "limit_surface")
    assert model.nmesh == 1 and model.mesh_vertnum[0] == 2 * len(obj.outline)


@pytest.mark.long
def test_pads_stand_where_the_object_does_and_turn_as_hard():
    """Under rims, wheels and heads of tools: c of the feet is near that of uniform pressure."""
    off = {}
    for name, obj in load_catalogue().items():
        fraction = scene_module._feet_fraction(obj, SceneSettings(table="pads"))
        spots = obj.center[:2] + fraction * obj.half_extents[:2]
        com = np.asarray(obj.inertial.com)[:2]
        c = np.linalg.norm(spots - com, axis=1).mean()
        off[name] = abs(c / friction_radius(obj.support, com) - 1.0)
        assert 3 <= len(spots) <= 16, name
    assert np.median(list(off.values())) < 0.03
    assert max(off.values()) < 0.3, max(off, key=lambda name: off[name])
    block = trimesh.creation.box((0.2, 0.2, 0.1)).apply_translation((0.0, 0.0, 0.05))
    assert len(feet(compiled(from_parts("box", [Part(block, 1.0)]), "pads"))) == 16


def test_friction_radius_is_that_of_the_patches():
    """A tube's is that of its ring: larger than the disc's two thirds of the radius."""
    tube = load_catalogue("tube")["tube"]
    radius = float(object_parameters(tube, friction=0.3).friction_radius)
    assert radius == pytest.approx(friction_radius(tube.support, np.zeros(2)), rel=1e-5)
    assert radius == pytest.approx(0.048, rel=2e-3)
    assert radius > 1.4 * friction_radius(tube.outline, np.zeros(2))
    assert shapely.Polygon(tube.outline).area > shapely.Polygon(tube.support[1]).area
