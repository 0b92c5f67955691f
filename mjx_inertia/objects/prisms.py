"""Cubes, cuboids and upright prisms with their true inertia.

In: sizes and a mass. Out: `ObjectModel` of uniform density, or with a stated CoM and I_zz.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.objects.model import ObjectModel, checked_outline
from mjx_inertia.objects.outline import planar_integrals
from mjx_inertia.spatial import InertialParameters, inertia_from_second_moment


def cube(edge: float, mass: float, name: str = "cube") -> ObjectModel:
    """A uniform cube centred on the object frame's z axis: I = m a² / 6 about every axis."""
    return cuboid((edge, edge, edge), mass, name=name)


def cuboid(size: tuple[float, float, float], mass: float, name: str = "cuboid") -> ObjectModel:
    """A uniform cuboid centred on the object frame's z axis; `size` along x, y, z in m."""
    if not all(np.isfinite(edge) and edge > 0.0 for edge in size):
        raise ValueError(f"{name}: size {size} m has an edge that is not positive")
    x, y = 0.5 * size[0], 0.5 * size[1]
    outline = np.array([[x, y], [-x, y], [-x, -y], [x, -y]])
    return prism(outline, size[2], mass, name=name)


def prism(
    outline: Float[ndarray, "k 2"],
    height: float,
    mass: float,
    *,
    inertia_zz: float | None = None,
    com: tuple[float, float] | None = None,
    name: str = "prism",
) -> ObjectModel:
    """An upright prism on `outline`.

    Uniform density unless told otherwise. With `inertia_zz`, the mass is taken to be spread like
    the outline but scaled in the plane: the planar second moments keep their ratios and sum to
    I_zz, while the spread along z stays m h² / 12. `com` moves the CoM in the plane and leaves
    the tensor about it; the CoM stays at half the height.

    Args:
      outline: (k, 2), m, simple.
      height: m.
      mass: kg.
      inertia_zz: about the CoM, kg m².
      com: x, y in the object frame, m.
      name: for messages.

    Raises:
      ValueError: values that no object can have.
    """
    outline = checked_outline(outline, name)
    if not (np.isfinite(mass) and mass > 0.0):
        raise ValueError(f"{name}: mass {mass} kg is not positive")
    if inertia_zz is not None and not (np.isfinite(inertia_zz) and inertia_zz > 0.0):
        raise ValueError(f"{name}: inertia_zz {inertia_zz} kg m² is not positive")
    if com is not None and not np.all(np.isfinite(com)):
        raise ValueError(f"{name}: com {com} m is not finite")
    plane = planar_integrals(outline)
    spread = mass * plane.second_moment / plane.area
    if inertia_zz is not None:
        spread = spread * (inertia_zz / np.trace(spread))
    second_moment = np.zeros((3, 3))
    second_moment[:2, :2] = spread
    second_moment[2, 2] = mass * height**2 / 12.0
    center = plane.centroid if com is None else np.asarray(com, dtype=np.float64)
    return ObjectModel(
        name=name,
        outline=outline,
        height=height,
        inertial=InertialParameters(
            mass=jnp.asarray(np.float64(mass)),
            com=jnp.asarray(np.append(center, 0.5 * height)),
            inertia=inertia_from_second_moment(jnp.asarray(second_moment)),
        ),
    )
