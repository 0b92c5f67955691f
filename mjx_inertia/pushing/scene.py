"""The scene of a push as a MuJoCo model: an object on a table and a driven tip.

In: an `ObjectModel` and `SceneSettings`. Out: a `Scene`, compiled once, whose mass, size, friction
and contact are then changed per push by `parameters.py`.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.stats import qmc
from shapely import Polygon, contains_xy, union_all

from mjx_inertia.objects import ObjectModel, hull_vertices, signed_area, upright
from mjx_inertia.pushing.plan_view import plan_polygons
from mjx_inertia.pushing.quiet_mjx import mjx
from mjx_inertia.pushing.settings import (
    FLOOR_SOLIMP,
    FLOOR_SOLREF,
    GRAVITY,
    IMPRATIO,
    TIP_MASS,
    TIP_SOLIMP,
    TIP_SOLREF_FRICTION,
    SceneSettings,
)

# MuJoCo marks a body whose CoM lies at its origin, and MJX then ignores a change of the CoM in
# part of its pipeline: compile with a CoM beside the origin.
_COMPILED_COM = (0.003, 0.002)
_FOOT_RADIUS = 0.005
_DRAWN = 2**15  # places, evenly over the box around what an object stands on, among which to choose
_TILTS = 0.01  # m, by which what the tip meets may rise or sink on the table `corners`
_FEW = 16  # pieces; of more, the tip meets the upright prisms on their plan


@dataclass(frozen=True, eq=False)
class Scene:
    """A compiled scene and where its parts are."""

    object_model: ObjectModel  # the object that the scene was compiled for
    settings: SceneSettings  # how it was built
    model: mujoco.MjModel  # the MuJoCo model (the oracle's)
    mjx_model: mjx.Model  # the same on the device
    data: mjx.Data  # blank MJX data of the model
    body: int  # body id of the object
    tip_body: int  # body id of the tip
    hull: np.ndarray  # geoms of the object that the tip meets
    feet: np.ndarray  # geoms under the object that carry it (none in `corners`)
    # (n, 2), where each foot stands as a fraction of the half extents from the centre of the
    # footprint (`pads`), else zeros
    feet_fraction: np.ndarray
    tip_pairs: np.ndarray  # ids of the contact pairs of the tip and the object
    floor_pairs: np.ndarray  # ids of the contact pairs of the object and the table
    planar: bool  # the object moves in the plane of the table (and up and down), else freely
    # what the tip meets of an object that is no box, seen from above (`planar` only)
    polygons: np.ndarray | None

    @property
    def has_closed_form(self) -> bool:
        """Whether `closed_form.py` holds the contact problem of this scene."""
        return self.planar or self.object_model.is_box

    @property
    def tip_dofs(self) -> tuple[int, int]:
        """Degrees of freedom of the tip: the last two."""
        return self.model.nv - 2, self.model.nv - 1


def _feet_fraction(obj: ObjectModel, settings: SceneSettings) -> np.ndarray:
    if settings.table == "corners":
        return np.zeros((0, 2))
    if settings.table == "limit_surface":
        return np.zeros((1, 2))
    stands_on = union_all([Polygon(ring) for ring in obj.support if signed_area(ring) > 0.0])
    holes = union_all([Polygon(ring) for ring in obj.support if signed_area(ring) < 0.0])
    stands_on = stands_on.difference(holes)
    low, high = np.array(stands_on.bounds).reshape(2, 2)
    line = (np.arange(settings.pads) + 0.5) / settings.pads
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), -1).reshape(-1, 2)
    spots = low + grid * (high - low)
    if not contains_xy(stands_on, spots).all():  # a rim, feet, wheels or a slanting outline
        spots = low + qmc.Halton(2, scramble=False).random(_DRAWN)[1:] * (high - low)
        spots = spots[contains_xy(stands_on, spots)][: len(grid)]
        if len(spots) < 3:
            raise ValueError(f"{obj.name}: it stands on too little for pads; take another table")
    return (spots - obj.center[:2]) / obj.half_extents[:2]


def _add_object(spec: mujoco.MjSpec, obj: ObjectModel, settings: SceneSettings) -> list[str]:
    """Adds the object at the origin; returns the names of its hull geoms."""
    body = spec.worldbody.add_body(name="object")
    if settings.table == "corners":
        body.add_joint(name="free", type=mujoco.mjtJoint.mjJNT_FREE)
    else:
        slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
        for name, kind, axis in (
            ("x", slide, (1, 0, 0)),
            ("y", slide, (0, 1, 0)),
            ("z", slide, (0, 0, 1)),
            ("yaw", hinge, (0, 0, 1)),
        ):
            body.add_joint(name=name, type=kind, axis=axis)
    body.explicitinertial = True
    body.mass = float(obj.inertial.mass)
    body.ipos = (*_COMPILED_COM, obj.height / 2)
    body.inertia = np.diag(np.asarray(obj.inertial.inertia))
    off = {"contype": 0, "conaffinity": 0}
    if obj.is_box:
        box = mujoco.mjtGeom.mjGEOM_BOX
        body.add_geom(name="hull0", type=box, size=obj.half_extents, pos=obj.center, **off)
        return ["hull0"]
    hulls = {f"hull{i}": piece for i, piece in enumerate(_tip_pieces(obj, settings))}
    if settings.table == "corners" and len(obj.pieces) > 1:
        # a plane meets a body where it meets the body's convex hull
        hulls["base"] = hull_vertices(np.concatenate(obj.pieces))
    for name, vertices in hulls.items():
        spec.add_mesh(name=name, uservert=vertices.reshape(-1))
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **off)
    return list(hulls)


def _tip_pieces(obj: ObjectModel, settings: SceneSettings) -> list[np.ndarray]:
    """Convex bodies, as vertices, that the tip can touch."""
    height, radius = _tip_height(obj, settings), settings.tip_radius
    low, high = 0.0, obj.height
    if settings.table == "corners":
        low, high = height - radius - _TILTS, height + radius + _TILTS
        near = [p for p in obj.pieces if p[:, 2].min() < high and p[:, 2].max() > low]
        if 0 < len(near) <= _FEW:
            return near
        low, high = max(low, 0.0), min(high, obj.height)
    return [upright(plan, high - low, low) for plan in plan_polygons(obj, height, radius)]


def _tip_height(obj: ObjectModel, settings: SceneSettings) -> float:
    """Of its middle above the table, m."""
    return min(settings.tip_height, obj.height / 2)


def _add_tip(spec: mujoco.MjSpec, settings: SceneSettings, height: float) -> None:
    body = spec.worldbody.add_body(name="tip", pos=(0, 0, height))
    for name, axis in (("tip_x", (1, 0, 0)), ("tip_y", (0, 1, 0))):
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    body.add_geom(
        name="tip",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=(settings.tip_radius, 0, 0),
        mass=TIP_MASS,
        contype=0,
        conaffinity=0,
    )


def build_spec(obj: ObjectModel, settings: SceneSettings) -> mujoco.MjSpec:
    """The scene as an editable MuJoCo specification, object at rest at the origin."""
    # options: elliptic cones, and a solver that goes on until it has converged
    spec = mujoco.MjSpec()
    spec.option.timestep = settings.timestep
    spec.option.gravity = (0, 0, -GRAVITY)
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.impratio = IMPRATIO
    spec.option.tolerance = 0.0
    spec.option.iterations = 100
    spec.option.ls_iterations = 50
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(2, 2, 0.1),
        contype=0,
        conaffinity=0,
    )
    # object with its feet, and tip
    hull = _add_object(spec, obj, settings)
    _add_tip(spec, settings, _tip_height(obj, settings))
    body = spec.body("object")
    feet = []
    for i, _ in enumerate(_feet_fraction(obj, settings)):
        body.add_geom(
            name=f"foot{i}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=(_FOOT_RADIUS, 0, 0),
            pos=(0, 0, _FOOT_RADIUS),
            contype=0,
            conaffinity=0,
        )
        feet.append(f"foot{i}")
    # named contact pairs: tip and object, table and object
    condim = 4 if settings.table == "limit_surface" else 3
    for i, name in enumerate(name for name in hull if name != "base"):
        spec.add_pair(
            name=f"tip{i}",
            geomname1="tip",
            geomname2=name,
            condim=3,
            solref=(0.02, 1.0),
            solreffriction=TIP_SOLREF_FRICTION,
            solimp=TIP_SOLIMP,
        )
    for i, name in enumerate(feet or hull[-1:]):
        spec.add_pair(
            name=f"floor{i}",
            geomname1="floor",
            geomname2=name,
            condim=condim,
            solref=FLOOR_SOLREF,
            solimp=FLOOR_SOLIMP,
        )
    return spec


def _polygons(obj: ObjectModel, settings: SceneSettings) -> np.ndarray | None:
    if obj.is_box or settings.table == "corners":
        return None
    return plan_polygons(obj, _tip_height(obj, settings), settings.tip_radius)


def _starting(names: list[str], prefix: str) -> np.ndarray:
    return np.array([i for i, name in enumerate(names) if name.startswith(prefix)], int)


def build_scene(obj: ObjectModel, settings: SceneSettings | None = None) -> Scene:
    """Compiles the scene of one object.

    Args:
      obj: the object; a rectangle centred on its origin becomes a box whose size may differ from
        push to push. Of any other the tip meets, on the tables on which it stays upright, the
        upright prisms of `plan_polygons`; on `corners` its convex pieces at the height of the tip,
        or such prisms where they are many, while the table meets its convex hull.
      settings: the table, the tip and the step.
    """
    settings = settings or SceneSettings()
    model = build_spec(obj, settings).compile()

    geoms = [model.geom(i).name for i in range(model.ngeom)]
    pairs = [model.pair(i).name for i in range(model.npair)]  # MuJoCo sorts them by body

    return Scene(
        object_model=obj,
        settings=settings,
        model=model,
        mjx_model=mjx.put_model(model),
        data=mjx.make_data(model),
        body=model.body("object").id,
        tip_body=model.body("tip").id,
        hull=_starting(geoms, "hull"),
        feet=_starting(geoms, "foot"),
        feet_fraction=_feet_fraction(obj, settings),
        tip_pairs=_starting(pairs, "tip"),
        floor_pairs=_starting(pairs, "floor"),
        planar=settings.table != "corners",
        polygons=_polygons(obj, settings),
    )
