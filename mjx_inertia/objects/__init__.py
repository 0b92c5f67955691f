"""Shapes with their true inertia: the catalogue, prisms on an outline, published objects."""

from mjx_inertia.objects.catalogue.load import CATEGORIES, load_catalogue
from mjx_inertia.objects.compose import combine_objects, re_mass, scale_object
from mjx_inertia.objects.convex import area_error, convex_pieces, hull_vertices, upright
from mjx_inertia.objects.density_field import properties_of_field
from mjx_inertia.objects.depth_camera import (
    CameraSettings,
    DepthViews,
    camera_ring,
    cast_views,
    join_views,
    point_cloud,
    with_noise,
)
from mjx_inertia.objects.depth_fusion import FusedSolid, FusionSettings, TriangleMesh, fuse_views
from mjx_inertia.objects.export import export_objects
from mjx_inertia.objects.manifolds import outlines_between
from mjx_inertia.objects.mcube import load_mcube_objects
from mjx_inertia.objects.mesh_defects import Finding, MeshDefect, find_defects
from mjx_inertia.objects.mesh_integrals import mass_properties, polyhedron_properties
from mjx_inertia.objects.mesh_repair import RepairedMesh, repair_mesh
from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.object_import import import_object
from mjx_inertia.objects.outline import (
    OutlineContact,
    PlanarIntegrals,
    closest_on_outline,
    friction_radius,
    planar_integrals,
    signed_area,
)
from mjx_inertia.objects.part import Part, moved, on_table, transformed, turned
from mjx_inertia.objects.part_assembly import from_parts
from mjx_inertia.objects.prisms import cube, cuboid, prism
from mjx_inertia.objects.random_shapes import RandomShapes, random_objects
from mjx_inertia.objects.shape_and_push import (
    FULL_INERTIA_NAMES,
    FullInertia,
    UniformityTest,
    combine_shape_and_push,
)
from mjx_inertia.objects.shape_estimate import ShapeEstimate, estimate_shape
from mjx_inertia.objects.voxels import VoxelGrid, voxel_properties, voxelize

__all__ = [
    "CATEGORIES",
    "FULL_INERTIA_NAMES",
    "CameraSettings",
    "DepthViews",
    "Finding",
    "FullInertia",
    "FusedSolid",
    "FusionSettings",
    "MeshDefect",
    "ObjectModel",
    "OutlineContact",
    "Part",
    "PlanarIntegrals",
    "RandomShapes",
    "RepairedMesh",
    "ShapeEstimate",
    "TriangleMesh",
    "UniformityTest",
    "VoxelGrid",
    "area_error",
    "camera_ring",
    "cast_views",
    "closest_on_outline",
    "combine_objects",
    "combine_shape_and_push",
    "convex_pieces",
    "cube",
    "cuboid",
    "estimate_shape",
    "export_objects",
    "find_defects",
    "friction_radius",
    "from_parts",
    "fuse_views",
    "hull_vertices",
    "import_object",
    "join_views",
    "load_catalogue",
    "load_mcube_objects",
    "mass_properties",
    "moved",
    "on_table",
    "outlines_between",
    "planar_integrals",
    "point_cloud",
    "polyhedron_properties",
    "prism",
    "properties_of_field",
    "random_objects",
    "re_mass",
    "repair_mesh",
    "scale_object",
    "signed_area",
    "transformed",
    "turned",
    "upright",
    "voxel_properties",
    "voxelize",
    "with_noise",
]
