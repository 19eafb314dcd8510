"""What `flatpush view` was given: a scene, a plan, or the log of a run with one of them."""

from dataclasses import dataclass
from pathlib import Path

from ..documents import load_plan, load_scene, mapping_of, parse_scene, read_mapping, scene_template
from ..errors import InputError
from ..problem import Plan, Scene
from .in_mm import scene_in_mm
from .recorded import LOGS, recorded


@dataclass(frozen=True, eq=False)
class Opened:
    """What a page shows first.

    Attributes:
        scene: a document as in_mm has it.
        plan: of that scene, shown until something is changed.
        runs: recorded ones, as recorded.py has them.
    """

    scene: dict[str, object]
    plan: Plan | None = None
    runs: tuple[dict[str, object], ...] = ()


def opened(file: Path | None, of: Path | None) -> Opened:
    """What a file holds; a triangle if there is none.

    Args:
        of: the scene or the plan of a log.

    Raises:
        InputError: for a file that is none of these, a log without `of`, and anything else with it.
    """
    if file is not None and file.suffix.lower() in LOGS:
        if of is None:
            raise InputError(
                "a log does not hold the outline of its object",
                source=str(file),
                hint="Give its scene or its plan: --scene FILE.",
            )
        scene, plan = _read(of)
        return Opened(scene_in_mm(scene), plan, tuple(recorded(file, scene, plan)))
    if of is not None:
        raise InputError("--scene belongs to a log", value=str(of))
    if file is None:
        return Opened(scene_in_mm(parse_scene(mapping_of(scene_template()))))
    scene, plan = _read(file)
    return Opened(scene_in_mm(scene), plan)


def _read(file: Path) -> tuple[Scene, Plan | None]:
    """A scene, or a plan with its scene."""
    kind = read_mapping(file).get("flatpush")
    if isinstance(kind, str) and kind.startswith("plan/"):
        plan = load_plan(file)
        return plan.scene, plan
    return load_scene(file), None
