"""The Tools of the catalogue.

Where the Workshop Tools Dataset has the tool, its mass and its largest extents are met.
"""

from mjx_inertia.objects.catalogue.carpentry import chisel, crowbar, hammer, wood_saw
from mjx_inertia.objects.catalogue.fastening import (
    adjustable_wrench,
    allen_key,
    screwdriver,
    spanner,
)
from mjx_inertia.objects.catalogue.gripping import c_clamp, pliers
from mjx_inertia.objects.catalogue.materials import (
    ABS,
    ALUMINIUM,
    CAST_STEEL,
    PVC,
    RUBBER,
    STEEL,
    VINYL,
    WOOD,
)
from mjx_inertia.objects.catalogue.recipe import of_function
from mjx_inertia.objects.catalogue.site_tools import drill, spirit_level, tape_measure

_DATASET = "Workshop Tools Dataset (Nadeau, Giamou, Kelly 2023, arXiv 2302.06685)"

TOOLS = (
    of_function(
        hammer,
        "Tools",
        0.6897,
        f"mass, extents and materials of Hammer, {_DATASET}",
        RUBBER.friction,
    ),
    of_function(
        adjustable_wrench,
        "Tools",
        0.71895,
        f"mass, length and materials of Adjustable Wrench, {_DATASET}; thinner and narrower",
        CAST_STEEL.friction,
    ),
    of_function(
        screwdriver,
        "Tools",
        0.03043,
        f"mass, extents and materials of Screwdriver, {_DATASET}",
        PVC.friction,
    ),
    of_function(
        pliers,
        "Tools",
        0.63318,
        f"mass and extents of Pliers, {_DATASET}; vinyl grips added",
        VINYL.friction,
    ),
    of_function(
        drill,
        "Tools",
        None,
        "densities x sizes of an 18 V drill with a 2 Ah pack, a class of 1.5 to 1.9 kg",
        ABS.friction,
    ),
    of_function(
        crowbar,
        "Tools",
        None,
        "density of steel x size of a 600 mm wrecking bar of 18 mm hexagonal steel",
        STEEL.friction,
    ),
    of_function(
        wood_saw,
        "Tools",
        None,
        "densities x sizes of a 450 mm hand saw with a 0.9 mm blade and a beech handle",
        WOOD.friction,
    ),
    of_function(
        chisel,
        "Tools",
        None,
        "densities x sizes of a 25 mm bevel-edge chisel with a wooden handle",
        WOOD.friction,
    ),
    of_function(
        c_clamp,
        "Tools",
        0.59804,
        f"mass, extents and materials of C Clamp, {_DATASET}; its bar turned into the plane",
        CAST_STEEL.friction,
    ),
    of_function(
        spanner,
        "Tools",
        None,
        "density of steel x proportions of a 19 mm combination spanner (DIN 3113)",
        STEEL.friction,
    ),
    of_function(
        allen_key,
        "Tools",
        0.12808,
        f"mass, extents and material of Allen Key, {_DATASET}",
        STEEL.friction,
    ),
    of_function(
        tape_measure,
        "Tools",
        0.13627,
        f"mass and extents of Measuring Tape, {_DATASET}; the inside as in a 5 m tape",
        ABS.friction,
    ),
    of_function(
        spirit_level,
        "Tools",
        None,
        "densities x sizes of a 400 mm level of 1.6 mm aluminium box section",
        ALUMINIUM.friction,
    ),
)
