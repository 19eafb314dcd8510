"""flatpush: an object on a table, pushed by fingers that stick to it, steers like a car.

>>> import flatpush as fp
>>> scene = fp.Scene(
...     fp.Object([(0.02, -0.01), (0.02, 0.02), (-0.04, -0.01)], friction=0.3),
...     start=(0.06, 0.02, 2.4),
...     pusher=fp.Pusher(fingers=2, spacing=0.018),
... )
>>> plan = fp.plan(scene)
>>> plan.status, fp.verify(plan).ok
('solved', True)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

# Name → module; loaded when first asked for, so that a program pays only for what it uses.
_NAMES = {
    "Arc": "problem",
    "Certificate": "problem",
    "Claim": "simulation",
    "CollinearSupportWarning": "friction",
    "ContactMode": "contact",
    "Ellipsoid": "friction",
    "Exact": "friction",
    "FlatpushError": "errors",
    "InputError": "errors",
    "LimitSurface": "friction",
    "MissingExtra": "errors",
    "NoDubinsReduction": "errors",
    "Noise": "simulation",
    "Object": "problem",
    "Outline": "geometry",
    "Plan": "problem",
    "Planner": "planning",
    "Planning": "problem",
    "PointContact": "contact",
    "Proof": "simulation",
    "Push": "problem",
    "Pusher": "problem",
    "Quartic": "friction",
    "Report": "simulation",
    "Rollout": "problem",
    "Runs": "simulation",
    "Scene": "problem",
    "StartRegion": "problem",
    "Support": "friction",
    "Uncertainty": "problem",
    "Workspace": "problem",
    "describe": "planning",
    "fit_ellipsoid": "friction",
    "fit_quartic": "friction",
    "flat_output": "steering",
    "load_plan": "documents",
    "load_scene": "documents",
    "plan": "planning",
    "prove": "simulation",
    "simulate": "simulation",
    "study": "simulation",
    "two_point_sticks": "contact",
    "verify": "simulation",
}
_MODULES = ("dubins",)

__all__ = [
    "Arc",
    "Certificate",
    "Claim",
    "CollinearSupportWarning",
    "ContactMode",
    "Ellipsoid",
    "Exact",
    "FlatpushError",
    "InputError",
    "LimitSurface",
    "MissingExtra",
    "NoDubinsReduction",
    "Noise",
    "Object",
    "Outline",
    "Plan",
    "Planner",
    "Planning",
    "PointContact",
    "Proof",
    "Push",
    "Pusher",
    "Quartic",
    "Report",
    "Rollout",
    "Runs",
    "Scene",
    "StartRegion",
    "Support",
    "Uncertainty",
    "Workspace",
    "__version__",
    "describe",
    "dubins",
    "fit_ellipsoid",
    "fit_quartic",
    "flat_output",
    "load_plan",
    "load_scene",
    "plan",
    "prove",
    "simulate",
    "study",
    "two_point_sticks",
    "verify",
]

if TYPE_CHECKING:
    from .contact import ContactMode, PointContact, two_point_sticks
    from .documents import load_plan, load_scene
    from .errors import FlatpushError, InputError, MissingExtra, NoDubinsReduction
    from .friction import (
        CollinearSupportWarning,
        Ellipsoid,
        Exact,
        LimitSurface,
        Quartic,
        Support,
        fit_ellipsoid,
        fit_quartic,
    )
    from .geometry import Outline
    from .planning import Planner, describe, plan
    from .problem import (
        Arc,
        Certificate,
        Object,
        Plan,
        Planning,
        Push,
        Pusher,
        Rollout,
        Scene,
        StartRegion,
        Uncertainty,
        Workspace,
    )
    from .simulation import Claim, Noise, Proof, Report, Runs, prove, simulate
    from .simulation.study import study
    from .simulation.verify import verify
    from .steering import dubins, flat_output


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        value = import_module(f"flatpush.steering.{name}")
    elif name in _NAMES:
        value = getattr(import_module(f"flatpush.{_NAMES[name]}"), name)
    else:
        raise AttributeError(f"module 'flatpush' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
