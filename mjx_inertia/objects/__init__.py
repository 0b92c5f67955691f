"""Shapes with their true inertia: catalogue, prisms, composites, files, what cameras see."""

from mjx_inertia.objects.catalogue.load import load_catalogue as load_catalogue
from mjx_inertia.objects.composition import (
    combine_objects as combine_objects,
    from_parts as from_parts,
    re_mass as re_mass,
    scale_object as scale_object,
)
from mjx_inertia.objects.convex import (
    convex_pieces as convex_pieces,
    hull_vertices as hull_vertices,
    upright as upright,
)
from mjx_inertia.objects.depth_views import (
    CameraSettings as CameraSettings,
    FusionSettings as FusionSettings,
    TriangleMesh as TriangleMesh,
    camera_ring as camera_ring,
    cast_views as cast_views,
    join_views as join_views,
    with_noise as with_noise,
)
from mjx_inertia.objects.export import export_objects as export_objects
from mjx_inertia.objects.manifolds import outlines_between as outlines_between
from mjx_inertia.objects.mcube import load_mcube_objects as load_mcube_objects
from mjx_inertia.objects.mesh_integrals import (
    mass_properties as mass_properties,
    polyhedron_properties as polyhedron_properties,
)
from mjx_inertia.objects.model import (
    ObjectModel as ObjectModel,
    Part as Part,
    cube as cube,
    cuboid as cuboid,
    prism as prism,
)
from mjx_inertia.objects.object_import import import_object as import_object
from mjx_inertia.objects.outline import (
    OutlineContact as OutlineContact,
    closest_on_outline as closest_on_outline,
    friction_radius as friction_radius,
    in_object_frame as in_object_frame,
    planar_integrals as planar_integrals,
    signed_area as signed_area,
    turn_vectors as turn_vectors,
)
from mjx_inertia.objects.random_shapes import (
    RandomShapes as RandomShapes,
    random_objects as random_objects,
)
from mjx_inertia.objects.shape_estimate import (
    FULL_INERTIA_NAMES as FULL_INERTIA_NAMES,
    FullInertia as FullInertia,
    ShapeEstimate as ShapeEstimate,
    combine_shape_and_push as combine_shape_and_push,
    estimate_shape as estimate_shape,
)
from mjx_inertia.objects.voxels import (
    voxel_properties as voxel_properties,
    voxelize as voxelize,
)
