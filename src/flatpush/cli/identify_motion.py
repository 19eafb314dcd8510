"""flatpush identify of recordings without forces: the table and the finger's friction from motion alone."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ..errors import InputError
from .common import print_json, telling
from .recordings import layout_of, tell_left_out

if TYPE_CHECKING:
    from ..documents import Motion
    from ..identification import MotionFit, Radius, Suggestion, Summary

SUGGESTED = 3


@dataclass(frozen=True)
class Asked:
    """The options of the command that apply to motion."""

    data: Sequence[Path]
    scene: Path
    output: Path | None
    units: str
    columns: str
    skip_bad: bool
    suggest: bool
    as_json: bool


def identify_motion(asked: Asked) -> int:
    """Fits, prints, writes the scene."""
    from ..documents import load_scene

    if asked.output is not None and asked.output.suffix.lower() not in (".yaml", ".yml"):
        raise InputError("the fitted scene is a YAML file", source=str(asked.output), hint="-o fitted.yaml")
    own, length, angle = layout_of([asked.scene], asked.columns, asked.units)
    scene = load_scene(asked.scene, unknown=True)
    from ..documents import load_motions, save_fitted_scene
    from ..documents.motion_file import own_or_plain
    from ..identification import fit_motion, radii, suggest, summarise
    from ..planning.candidates import automatic_pushes
    from ..planning.reserve import reserve

    motions: list[Motion] = []
    for path in asked.data:
        columns = own if asked.columns else own_or_plain(path, own)
        file = load_motions(path, columns=columns, length=length, angle=angle, skip_bad=asked.skip_bad)
        if file.of_hand and scene.pusher.fingers == 2:
            raise InputError(
                "this log holds poses of the hand, whose two fingers do not push at one point",
                source=str(path),
                hint="Friction from motion takes pushes of one finger, with a scene that says pusher: {fingers: 1}.",
            )
        tell_left_out(path, file.left_out)
        motions += file.motions
    with telling("fitting"):
        fit = fit_motion(motions, scene.object, scene.pusher.tip_radius)
        pushes = automatic_pushes(scene)[0] if scene.pushes == "auto" else scene.pushes
        found = radii(fit, [push.at for push in pushes])
        names = [push.name for push in pushes]
        summary = summarise(fit, names, found)
        next_ = (
            suggest(fit, [p.at for p in pushes], scene.pusher.tip_radius, count=SUGGESTED)
            if asked.suggest
            else ()
        )
        kept = reserve(fit, scene)
    if kept is not None and kept.untold:
        summary = replace(summary, untold=(*summary.untold, kept.untold))
    if asked.output is not None:
        note = f"support and friction fitted to the motion of {len(set(fit.seen.stretches.push))} pushes"
        save_fitted_scene(
            asked.scene,
            asked.output,
            support=fit.thing.support,
            friction=fit.thing.friction,
            loads=0.0 if kept is None else kept.loads,
            note=note,
        )
    if asked.as_json:
        print_json({**_document(fit, summary, names, found, next_), "reserve": kept and asdict(kept)})
        return 0
    for line in _lines(fit, summary, names, found, next_, "" if kept is None else kept.text):
        typer.echo(line)
    if asked.output is not None:
        typer.echo(f"wrote {asked.output}")
    return 0


def _lines(
    fit: "MotionFit",
    s: "Summary",
    names: Sequence[str],
    found: Sequence["Radius"],
    next_: Sequence["Suggestion"],
    reserve: str,
) -> list[str]:
    place, turn = fit.seen.noise
    mm = 1000 * s.centre, 1000 * s.centre_sd
    odds = [(other.pressure.name, 0.5 * (other.evidence - fit.evidence)) for other in fit.others]
    others = [f"{name} less likely by e^{worse:.0f}" for name, worse in odds]
    pushes = len(set(fit.seen.stretches.push))
    lines = [
        f"{pushes} push{'es' * (pushes > 1)}, {fit.stretches} stretches of 15 mm, the finger slid on"
        f" {100 * fit.sliding:.0f} % of the way; noise {1000 * place:.2f} mm and {57.2958 * turn:.2f}°;"
        f" ends scatter {fit.scatter:.1f} times as much as that explains",
        "; ".join([f"support: {fit.pressure.name}", *others]),
        f"centre of friction ({mm[0][0]:.2f} ± {mm[1][0]:.2f} mm, {mm[0][1]:.2f} ± {mm[1][1]:.2f} mm),"
        f" ρ = {1e6 * s.rho:.1f} ± {1e6 * s.rho_sd:.1f} mm²",
        f"finger: μ {'=' if s.slid else '≥'} {s.friction:.3f} ± {s.friction_sd:.3f}",
    ]
    if len(s.shares):
        shares = ", ".join(f"{a:.3f} ± {b:.3f}" for a, b in zip(s.shares, s.shares_sd, strict=True))
        lines.append(f"loads of the feet: {shares} of the whole")
    lines.append("turning radii of one finger:")
    for name, radius in zip(names, found, strict=True):
        value = "cannot turn both ways"
        if radius.value == radius.value:
            value = f"{1000 * radius.value:.1f} ± {1000 * radius.sd:.1f} mm"
        lines.append(f"  {name}: {value}")
    lines += [reserve] if reserve else []
    lines += [f"not told: {text}" for text in s.untold]
    for k, one in enumerate(next_):
        x, y = 1000 * one.at.point
        lines.append(
            f"push {k + 1} to make next: at ({x:.1f} mm, {y:.1f} mm), {57.2958 * one.direction:+.0f}° from the inward"
            f" normal, {1000 * one.length:.0f} mm; leaves the radii uncertain by {100 * one.uncertainty:.1f} %"
        )
    return lines


def _document(
    fit: "MotionFit",
    s: "Summary",
    names: Sequence[str],
    found: Sequence["Radius"],
    next_: Sequence["Suggestion"],
) -> dict[str, Any]:
    def number(value: float) -> float | None:
        return value if value == value else None

    points, weights = fit.thing.support.feet
    return {
        "pushes": len(set(fit.seen.stretches.push)),
        "stretches": fit.stretches,
        "sliding": fit.sliding,
        "noise": list(fit.seen.noise),
        "scatter": fit.scatter,
        "family": fit.pressure.name,
        "others": {other.pressure.name: other.evidence - fit.evidence for other in fit.others},
        "centre": s.centre.tolist(),
        "centre_sd": s.centre_sd.tolist(),
        "rho": s.rho,
        "rho_sd": s.rho_sd,
        "friction": s.friction,
        "friction_sd": s.friction_sd,
        "friction_is": "known" if s.slid else "at least",
        "shares": s.shares.tolist(),
        "shares_sd": s.shares_sd.tolist(),
        "support": [[*p, w] for p, w in zip(points.tolist(), weights.tolist(), strict=True)],
        "radii": {n: [number(r.value), number(r.sd)] for n, r in zip(names, found, strict=True)},
        "untold": list(s.untold),
        "suggested": [
            {
                "at": one.at.point.tolist(),
                "direction": one.direction,
                "length": one.length,
                "leaves": one.uncertainty,
            }
            for one in next_
        ],
    }
