"""How the table resists: the wrench of a twist and the twist of a wrench."""

from .ellipsoid import Ellipsoid
from .exact import Exact
from .fits import fit_ellipsoid, fit_quartic, fit_surface, sized
from .loads import LoadsFit, fit_loads
from .local import local_ellipsoid
from .pairs import Pairs
from .quartic import Quartic
from .report import FitReport
from .support import CollinearSupportWarning, Support
from .surface import LimitSurface, WrenchSet

__all__ = [
    "CollinearSupportWarning",
    "Ellipsoid",
    "Exact",
    "FitReport",
    "LimitSurface",
    "LoadsFit",
    "Pairs",
    "Quartic",
    "Support",
    "WrenchSet",
    "fit_ellipsoid",
    "fit_loads",
    "fit_quartic",
    "fit_surface",
    "local_ellipsoid",
    "sized",
]
