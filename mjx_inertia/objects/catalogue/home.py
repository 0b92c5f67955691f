"""The Home things of the catalogue, but for those that the thesis names.

All masses are volume times density at the sizes and wall thicknesses of the real thing.
"""

from mjx_inertia.objects.catalogue.electronics import phone, remote_control
from mjx_inertia.objects.catalogue.household import (
    alarm_clock,
    cardboard_box,
    kettle,
    lamp,
    vase,
)
from mjx_inertia.objects.catalogue.materials import (
    ABS,
    ALUMINIUM,
    CARDBOARD,
    CERAMIC,
    GLASS,
    STAINLESS,
    STEEL,
    WOOD,
)
from mjx_inertia.objects.catalogue.recipe import of_function
from mjx_inertia.objects.catalogue.tableware import (
    bottle,
    bowl,
    can,
    dinner_plate,
    mug,
    wine_glass,
)

_STONEWARE = "stoneware, 2400 kg/m³, at the usual wall thickness"

HOME = (
    of_function(mug, "Home", None, f"{_STONEWARE} of a 0.3 l mug", CERAMIC.friction),
    of_function(bowl, "Home", None, f"{_STONEWARE} of a cereal bowl", CERAMIC.friction),
    of_function(
        dinner_plate,
        "Home",
        None,
        "porcelain, 2400 kg/m³, at the usual thickness of a 26.5 cm plate",
        CERAMIC.friction,
    ),
    of_function(
        wine_glass,
        "Home",
        None,
        "soda-lime glass, 2500 kg/m³, with a bowl 1.5 mm thick",
        GLASS.friction,
    ),
    of_function(
        bottle,
        "Home",
        None,
        "glass, 2500 kg/m³, at the 3.5 mm of an empty 0.75 l Bordeaux bottle, 0.4 to 0.6 kg",
        GLASS.friction,
    ),
    of_function(
        can,
        "Home",
        None,
        "0.33 l of lemonade, 1040 kg/m³, in 13 g of aluminium",
        ALUMINIUM.friction,
    ),
    of_function(
        kettle,
        "Home",
        None,
        "stainless steel, 7900 kg/m³, 0.9 mm thick, with resin grips",
        STAINLESS.friction,
    ),
    of_function(vase, "Home", None, f"{_STONEWARE} of a 26 cm vase", CERAMIC.friction),
    of_function(
        lamp,
        "Home",
        None,
        "beech, brass, glass and a fabric shade of 0.5 kg/m² at the sizes of a bedside lamp",
        WOOD.friction,
    ),
    of_function(
        cardboard_box,
        "Home",
        None,
        "corrugated board of 0.6 kg/m² at the size of a 30 x 22 x 16 cm parcel",
        CARDBOARD.friction,
    ),
    of_function(
        phone,
        "Home",
        None,
        "glass, aluminium and battery at the sizes of a 6.1 inch phone, 0.17 to 0.18 kg",
        GLASS.friction,
    ),
    of_function(
        remote_control,
        "Home",
        None,
        "ABS case of 2 mm, rubber keys, circuit board and two AAA cells of 11.5 g",
        ABS.friction,
    ),
    of_function(
        alarm_clock,
        "Home",
        None,
        "case and bells of 0.8 and 1 mm steel, brass works, at the size of a twin-bell clock",
        STEEL.friction,
    ),
)
