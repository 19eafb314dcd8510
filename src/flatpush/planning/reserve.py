"""How much plans for two fingers must allow for on a table that was fitted to motion."""

from dataclasses import dataclass, replace

import numpy as np

from ..contact import PointContact, WrenchCone
from ..errors import FlatpushError
from ..identification import MotionFit
from ..problem import Object, Scene, Uncertainty
from ..problem.mechanics import cone_motions, placement_of, surface_at, takes_cone, virtual_contact
from .candidates import automatic_pushes

# So many tables that explain the motion are tried, with loads that plans allow to differ by these shares, until the
# motions of every push hold on so many of them.
DRAWN, SHARES, ENOUGH = 60, (0.0, 0.05, 0.1, 0.2, 0.3), 0.95


@dataclass(frozen=True)
class Reserve:
    """What plans for two fingers allow for.

    Attributes:
        loads: the share by which loads may differ. held: of the tables that explain the motion as well, the share on
            which every motion of a push holds that is proved for such loads; of the push with the least.
        without: the same for motions that are those of the fitted table.
        push: the push with the least, by name.
    """

    loads: float
    held: float
    without: float
    push: str

    @property
    def text(self) -> str:
        """In words."""
        what = "of the tables that explain the motion as well"
        if not self.loads:
            return f"two fingers: every push holds on {100 * self.held:.0f} % {what}"
        return (
            f"two fingers: every push holds on {100 * self.held:.0f} % {what}, as plans allow for loads that differ by"
            f" {100 * self.loads:.0f} % (object: uncertainty); without on {100 * self.without:.0f} %"
        )

    @property
    def untold(self) -> str:
        """What the motion does not tell, in words, or ""."""
        if self.held >= ENOUGH:
            return ""
        return (
            f"whether two fingers hold the object in turns of {self.push}: they do on {100 * self.held:.0f} % of the"
            " tables that explain the motion as well; film more pushes (--suggest)"
        )


def reserve(fit: MotionFit, scene: Scene) -> Reserve | None:
    """What plans of a scene must allow for where its table is that of a fit; None where no push is one of two fingers.

    A plan makes a push's left turn, straight motion and right turn, so these are asked for on drawn tables.
    """
    tables = fit.drawn(DRAWN, np.random.default_rng(0))
    known = scene.object.uncertainty
    least = known.loads if known is not None else 0.0
    found: list[tuple[float, float, str]] = []
    for share in sorted({max(share, least) for share in SHARES}):
        thing = Object(
            fit.thing.outline, fit.thing.support, fit.thing.friction, None, fit.thing.name, Uncertainty(share)
        )
        held = _held(replace(scene, object=thing), tables)
        if held:
            worst = min(held, key=lambda name: held[name])
            found.append((share, held[worst], worst))
        if not found or found[-1][1] >= ENOUGH:
            break
    if not found:
        return None
    best = max(found, key=lambda one: one[1])
    return Reserve(*best[:2], found[0][1], best[2])


def _held(scene: Scene, tables: list[Object]) -> dict[str, float]:
    """Of tables, the share on which a push of two fingers holds, by its name."""
    pushes = automatic_pushes(scene)[0] if scene.pushes == "auto" else scene.pushes
    found = {}
    for push in pushes:
        if not takes_cone(scene, push.fingers):
            continue
        try:
            placement = placement_of(scene, push)
            motions = cone_motions(scene, placement, surface_at(scene, virtual_contact(scene, placement)))
        except FlatpushError:
            continue  # planning refuses it as well, and says why
        points, normals, cof = placement.points, placement.normals, scene.object.cof
        holds = []
        for table in tables:
            contacts = [
                PointContact(p - cof, n, table.friction, hook=True)
                for p, n in zip(points, normals, strict=True)
            ]
            holds.append(
                np.all(WrenchCone.of(contacts).depth(table.support.translated(-cof).wrench(motions)) >= 0)
            )
        found[push.name] = float(np.mean(holds))
    return found
