"""Rigid-body facts without objects or simulation, and the conventions of the whole library.

SI units. A frame is in the name: `T_new_old` maps coordinates in `old` to coordinates in `new`.
Quaternions are wxyz. Twists and wrenches are (linear, angular): a twist is the velocity of the
frame's origin (m/s) and the angular velocity (rad/s), a wrench the force (N) and the moment about
the frame's origin (N m), both in the axes of the frame. Functions are written for one body.
"""

from mjx_inertia.spatial.arrays import AnyArray
from mjx_inertia.spatial.consistency import (
    Consistency,
    check_consistency,
    explain_consistency,
    thicken,
)
from mjx_inertia.spatial.inertia import (
    InertialParameters,
    change_frame,
    combine,
    inertia_about,
    kinetic_energy,
    point_mass_inertia,
)
from mjx_inertia.spatial.log_cholesky import (
    LOG_CHOLESKY_NAMES,
    from_log_cholesky,
    to_log_cholesky,
)
from mjx_inertia.spatial.planar import (
    PlanarInertia,
    change_frame_planar,
    from_planar,
    to_planar,
)
from mjx_inertia.spatial.plane import planar_cross, planar_rotate
from mjx_inertia.spatial.pose import Pose
from mjx_inertia.spatial.principal import PrincipalInertia, from_principal, to_principal
from mjx_inertia.spatial.representations import (
    TEN_VECTOR_NAMES,
    from_pseudo_inertia,
    from_spatial_inertia,
    from_ten_vector,
    skew,
    to_pseudo_inertia,
    to_spatial_inertia,
    to_ten_vector,
)
from mjx_inertia.spatial.second_moment import inertia_from_second_moment, second_moment_from_inertia

__all__ = [
    "LOG_CHOLESKY_NAMES",
    "TEN_VECTOR_NAMES",
    "AnyArray",
    "Consistency",
    "InertialParameters",
    "PlanarInertia",
    "Pose",
    "PrincipalInertia",
    "change_frame",
    "change_frame_planar",
    "check_consistency",
    "combine",
    "explain_consistency",
    "from_log_cholesky",
    "from_planar",
    "from_principal",
    "from_pseudo_inertia",
    "from_spatial_inertia",
    "from_ten_vector",
    "inertia_about",
    "inertia_from_second_moment",
    "kinetic_energy",
    "planar_cross",
    "planar_rotate",
    "point_mass_inertia",
    "second_moment_from_inertia",
    "skew",
    "thicken",
    "to_log_cholesky",
    "to_planar",
    "to_principal",
    "to_pseudo_inertia",
    "to_spatial_inertia",
    "to_ten_vector",
]
