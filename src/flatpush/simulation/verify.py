"""Recomputes every claim of a plan from its scene, and checks what a robot will execute."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..arguments import made_of
from ..documents.scene_digest import SceneDifference, scene_differences, scene_digest
from ..errors import FlatpushError, InputError
from ..problem import Certificate, Plan, Scene
from ..problem.certificate import SetWorst
from ..problem.mechanics import proved_for_set, starts_anywhere
from .claims import NO_RESERVE, arc_costs, certify
from .execution import Finding, execution_findings
from .proof import worst_depth
from .slides import slide_sensitivity
from .tube import tube_excess

RELATIVE, ABSOLUTE = 1e-6, 1e-9
# Keys of a certificate that plans of an earlier version do not have.
LATER = {"set_bounds", "set_worst", "set_uniqueness"}


@dataclass(frozen=True)
class Claim:
    """One claim of a plan and what came out when it was recomputed.

    Attributes:
        name: the claim.
        stated, recomputed: numbers, lists or words; stated is None for what holds without being stated.
        tolerance: allowed difference, relative or absolute, or the limit that recomputed must keep.
        ok: whether it holds.
        rule: in words.
    """

    name: str
    stated: Any
    recomputed: Any
    tolerance: float
    ok: bool
    rule: str = "as stated"


@dataclass(frozen=True)
class Report:
    """All claims of a plan; ok if every one holds."""

    claims: tuple[Claim, ...]

    @property
    def ok(self) -> bool:
        """Whether every claim holds."""
        return all(claim.ok for claim in self.claims)

    @property
    def failed(self) -> tuple[Claim, ...]:
        """The claims that do not hold, in order."""
        return tuple(claim for claim in self.claims if not claim.ok)


def verify(plan: Plan, scene: Scene | None = None) -> Report:
    """Recomputes every claim of a plan from its scene and checks what every plan must keep.

    Args:
        scene: the scene that is trusted; every difference of the plan's own scene from it is a claim that fails.
            Default: the plan's scene is believed.

    Raises:
        InputError: for what is no Plan or Scene, and for a Plan that is not solved.
    """
    made_of(Plan, plan, "load_plan")
    if scene is not None:
        made_of(Scene, scene, "load_scene")
    if plan.status != "solved":
        raise InputError("there is no plan to verify", hint=plan.reason)
    trusted = [] if scene is None else [_difference(d) for d in scene_differences(plan.scene, scene)]
    try:
        findings = execution_findings(plan.scene, plan.segments)
        if any(not s.arcs for s in plan.pushes) or (plan.segments and not plan.on_table):
            return Report((*trusted, *(_executed(finding) for finding in findings)))
        computed = certify(plan.scene, plan.segments)
    except FlatpushError as error:
        wrong = Claim("mechanics", "a plan for its scene", str(error), 0.0, False, "must make sense")
        return Report((*trusted, wrong))
    claims = [
        *trusted,
        *_same_scene(plan),
        _stated("cost", plan.cost, computed.cost),
        _stated("duration", plan.duration, computed.duration),
    ]
    claims += _certified(plan, computed)
    claims += [
        _stated(f"word of {s.push}", s.word, "".join(a.turn[0].upper() for a in s.arcs)) for s in plan.pushes
    ]
    claims += [_arc_turns(plan), _arc_costs(plan, computed)]
    claims += [_sensitivity(plan, k) for k in range(len(plan.slides))]
    goal = np.abs(computed.goal_error)
    tolerance = np.array(plan.scene.planning.goal_tolerance)
    excess = float(np.max(goal / tolerance))
    claims.append(Claim("reaches the goal", None, excess, 1.0, excess <= 1.0, "within the goal tolerance"))
    required = plan.scene.planning.friction_margin
    for key, least in (
        ("friction_margin", required),
        ("spacing_margin", required),
        ("motion_cone_margin_degrees", 0.0),
    ):
        value = getattr(computed, key)
        if value is not None:
            claims.append(
                Claim(f"{key} kept", None, value, least, bool(value >= least - ABSOLUTE), "at least as asked")
            )
    if computed.set_margin is not None and plan.scene.planning.proof == "set":
        kept = computed.set_margin >= -ABSOLUTE
        claims.append(
            Claim("set_margin kept", None, computed.set_margin, 0.0, kept, "on every table of the set")
        )
    claims += _tube_kept(plan.scene, computed)
    clearance = computed.clearance
    if clearance is not None:
        need = plan.scene.clearance
        claims.append(
            Claim("clearance kept", None, clearance, need, clearance >= need - ABSOLUTE, "as required")
        )
    return Report((*claims, *(_executed(finding) for finding in findings)))


def _tube_kept(scene: Scene, computed: Certificate) -> list[Claim]:
    """That a plan for a start region ends within the goal's tolerance and keeps clear from all of it."""
    if not (starts_anywhere(scene) and proved_for_set(scene)):
        return []
    if computed.tube is None:
        why = computed.warnings[-1] if computed.warnings else "there is no push"
        return [Claim("tube", None, why, 0.0, False, "from every start of the region")]
    share = tube_excess(scene, computed)
    claims = [Claim("tube ends at the goal", None, share, 1.0, share <= 1.0, "within the goal tolerance")]
    room, need = computed.set_clearance, scene.planning.clearance
    if room is not None:
        claims.append(Claim("tube kept clear", None, room, need, room >= need - ABSOLUTE, "as required"))
    return claims


def _executed(finding: Finding) -> Claim:
    limit = f"at most {finding.limit:.6g} {finding.unit}".strip()
    rule = limit if finding.ok else f"{finding.where}: {finding.value:.6g} {finding.unit}, {limit}"
    return Claim(f"executed: {finding.name}", None, finding.value, finding.limit, finding.ok, rule)


def _difference(difference: SceneDifference) -> Claim:
    key, found, wanted = difference
    return Claim(f"scene: {key}", found, wanted, 0.0, False, "as in the trusted scene")


def _same_scene(plan: Plan) -> list[Claim]:
    """That the scene is the one the plan was saved with; older plans do not say."""
    if not plan.scene_digest:
        return []
    digest = scene_digest(plan.scene)
    same = digest == plan.scene_digest
    return [Claim("scene_digest", plan.scene_digest, digest, 0.0, same, "the scene it was planned for")]


def _certified(plan: Plan, computed: Certificate) -> list[Claim]:
    """A claim for each number of a certificate; what older plans do not say of their set is none."""
    stated = plan.certificate
    if stated is None:
        return [Claim("certificate", None, "one that can be computed", 0.0, False, "a plan has one")]
    found, told = asdict(computed), asdict(stated)
    unknown = [Claim(key, str(value), None, 0.0, False, "known") for key, value in told.pop("others").items()]
    told = {key: value for key, value in told.items() if value is not None or key not in LATER}
    told.pop("set_worst", None)
    if NO_RESERVE not in told["warnings"]:  # an older plan
        found["warnings"] = tuple(w for w in found["warnings"] if w != NO_RESERVE)
    claims = [_stated(key, value, found[key]) for key, value in told.items()]
    if stated.set_worst is not None:
        claims.append(_set_worst(plan, stated.set_worst, computed))
    return claims + unknown


def _set_worst(plan: Plan, stated: SetWorst, computed: Certificate) -> Claim:
    """That the table named as the worst is one of the set, gives what it is said to give, and none is worse.

    Where several are as bad, rounding chooses among them, so that another may be named than is found here.
    """
    worst, bounds, ok = computed.set_worst, computed.set_bounds, False
    if worst is not None and bounds is not None and abs(stated.offset) <= bounds.offset + ABSOLUTE:
        depth = worst_depth(plan.scene, plan.pushes, stated)
        ok = _agree(stated.depth, depth) and (stated.depth < worst.depth or _agree(stated.depth, worst.depth))
    found = None if worst is None else asdict(worst)
    return Claim("set_worst", asdict(stated), found, RELATIVE, ok, "a table of the set, and none is worse")


def _stated(name: str, stated: Any, recomputed: Any) -> Claim:
    return Claim(name, stated, recomputed, RELATIVE, _agree(stated, recomputed))


def _agree(a: Any, b: Any) -> bool:
    if a is None and isinstance(b, float) and not math.isfinite(b):
        return True  # a document writes null for what is not finite
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_agree(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(_agree(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, int | float) and isinstance(b, int | float) and not isinstance(a, bool):
        near = max(ABSOLUTE, RELATIVE * max(abs(a), abs(b)))
        return bool(a == b or (math.isfinite(near) and abs(a - b) <= near))
    return bool(a == b)


def _sensitivity(plan: Plan, number: int) -> Claim:
    slide = plan.slides[number]
    found = slide_sensitivity(plan.scene, slide)
    return _stated(f"sensitivity of {slide.push}", dict(slide.sensitivity), found)


def _arc_turns(plan: Plan) -> Claim:
    names = {1: "left", 0: "straight", -1: "right"}
    bad = [a.turn for s in plan.pushes for a in s.arcs if names[int(np.sign(a.twist[2]))] != a.turn]
    return Claim("turns", None, bad, 0.0, not bad, "each arc turns as it is named")


def _arc_costs(plan: Plan, computed: Certificate) -> Claim:
    stated = [[a.cost for a in s.arcs] for s in plan.pushes]
    recomputed = [arc_costs(plan.scene, s, computed.cars[s.push]) for s in plan.pushes]
    return _stated("arc costs", stated, recomputed)
