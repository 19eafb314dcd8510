"""flatpush describe: the friction of a scene, and what it makes of every push."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .common import print_json, telling

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..planning import PushDescription
    from ..problem import Scene


def command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="The scene document, YAML or JSON.")],
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw cones and turning centres as .svg or .png.")
    ] = None,
    table_friction: Annotated[
        float | None,
        typer.Option(metavar="MU", help="Friction with the table: tells from which speed inertia counts."),
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="Height of the fingertips' contact: tells which pushes tip the object."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> int:
    """Show the friction model of SCENE and, for every push, its cone, flat point and turning radii."""
    from ..documents import check_outputs, load_scene, scene_files

    loaded = load_scene(scene)
    from ..documents import outline_note
    from ..planning import controllability, describe
    from ..planning.description import turning_radii

    note = outline_note(scene)
    if figure is not None:
        check_outputs(scene_files(scene), [figure])
    with telling("describing"):
        pushes = describe(loaded)
    if figure is not None:
        from ..view import describe_figure
        from ..view.sketches import sketches

        describe_figure(loaded, sketches(loaded, pushes), figure, note)
    data: dict[str, Any] = {
        "object": loaded.object.name,
        "outline": None if note is None else note.data(),
        "friction": loaded.object.friction,
        "centre_of_friction": [float(x) for x in loaded.object.cof],
        "second_moments": [[float(x) for x in row] for row in loaded.object.support.covariance],
        "controllability": controllability([p.option.car for p in pushes if p.option.car is not None]),
        "pushes": [_push(p, turning_radii(p)) for p in pushes],
    }
    if height is not None and table_friction is None:
        raise InputError("whether a push tips depends on the table's friction", hint="--table-friction MU")
    if table_friction is not None:
        data["assumptions"] = _assumptions(loaded, pushes, table_friction, height)
    if as_json:
        print_json(data)
        return 0
    _tell(data)
    if table_friction is not None:
        _tell_assumptions(data["assumptions"])
    if figure is not None:
        typer.echo(f"wrote {figure}")
    return 0


def _assumptions(
    scene: "Scene", pushes: "Sequence[PushDescription]", table_friction: float, height: float | None
) -> dict[str, Any]:
    """What is assumed of speed and height, in SI."""
    from ..problem.assumptions import coasting, quasi_static_speed, tipping_height

    if height is not None and not (math.isfinite(height) and height >= 0):
        raise InputError("a height is 0 or more", key="--height", value=height)
    support = scene.object.support
    return {
        "speed": scene.pusher.speed,
        "coasting": coasting(scene.pusher.speed, table_friction),
        "quasi_static_speed": quasi_static_speed(table_friction),
        "height": None if height is None else height / 1000,
        "tipping_heights": {
            p.push.name: tipping_height(support, p.push.at.normal, table_friction) for p in pushes
        },
    }


def _tell_assumptions(found: dict[str, Any]) -> None:
    from ..problem.assumptions import COASTS

    typer.echo(
        f"\nat {1000 * found['speed']:g} mm/s the object coasts {1000 * found['coasting']:.3f} mm when the pusher"
        f" stops; less than {1000 * COASTS:g} mm below {1000 * found['quasi_static_speed']:.1f} mm/s"
    )
    if found["coasting"] > COASTS:
        typer.echo(
            "warning: faster than what is quasi-static; a plan's last millimetres are off by that", err=True
        )
    for name, limit in found["tipping_heights"].items():
        typer.echo(f"push {name} slides the object when it is made lower than {1000 * limit:.1f} mm")
        if found["height"] is not None and found["height"] >= limit:
            typer.echo(f"warning: push {name} tips the object", err=True)


def _push(described: "PushDescription", radii: dict[str, float]) -> dict[str, Any]:
    car = described.option.car
    found: dict[str, Any] = {
        "name": described.push.name,
        "fingers": described.push.fingers,
        "at": [float(x) for x in described.push.at.point],
        "normal": [float(x) for x in described.push.at.normal],
        "refusal": described.option.refusal or None,
        "radii": {key: None if math.isnan(r) else r for key, r in radii.items()},
        "refusals": {key: car for key, car in described.cars.items() if isinstance(car, str)},
    }
    if car is not None:
        u_left, u_right = car.contact.motion_cone(car.surface)
        angles = car.contact.force_angles([u_left, u_right])
        found |= {
            "composite": car.cone is not None,
            "cone_degrees": [math.degrees(float(a)) for a in car.contact.force_angles(car.forces[[0, 2]])],
            "motion_cone_degrees": [math.degrees(float(a)) for a in angles],
            "flat_point": [float(x) for x in car.flat_point],
            "left_centre": [float(x) for x in car.left_centre],
            "right_centre": [float(x) for x in car.right_centre],
            "straight": [float(x) for x in car.direction],
            "divergence_length": described.divergence,
        }
    return found


def _tell(data: dict[str, Any]) -> None:
    from ..planning.controllability import WORDS
    from ..planning.description import MIDDLE

    mm = 1000.0
    cof, moments = data["centre_of_friction"], data["second_moments"]
    typer.echo(f"{data['object']}: friction between finger and object μ = {data['friction']}")
    for line in (data["outline"] or {}).get("lines", ()):
        typer.echo(line)
    x, y = (round(mm * value, 2) + 0.0 for value in cof)  # no -0.00
    typer.echo(f"centre of friction ({x:.2f}, {y:.2f}) mm in the frame of the drawing")
    typer.echo(
        f"second moments of the pressure xx {mm * mm * moments[0][0]:.1f}, yy {mm * mm * moments[1][1]:.1f},"
        f" xy {mm * mm * moments[0][1]:.1f} mm²"
    )
    typer.echo(WORDS[data["controllability"]])
    for push in data["pushes"]:
        at = push["at"]
        typer.echo(f"\npush {push['name']} at ({mm * at[0]:.2f}, {mm * at[1]:.2f}) mm")
        if push["refusal"]:
            typer.echo(f"  cannot steer: {push['refusal']}")
        else:
            z, c = push["flat_point"], push["cone_degrees"]
            edges = "forces of the turns" if push["composite"] else "friction cone"
            typer.echo(
                f"  {edges} {c[1]:+.1f}° to {c[0]:+.1f}°, motion cone {push['motion_cone_degrees'][1]:+.1f}°"
                f" to {push['motion_cone_degrees'][0]:+.1f}° about the inward normal (+ is left)"
            )
            left, right = push["left_centre"], push["right_centre"]
            typer.echo(
                f"  turns left about ({mm * left[0]:.1f}, {mm * left[1]:.1f}) mm,"
                f" right about ({mm * right[0]:.1f}, {mm * right[1]:.1f}) mm;"
                f" flat point ({mm * z[0]:.1f}, {mm * z[1]:.1f}) mm"
            )
            if push["fingers"] == 1:
                typer.echo(
                    f"  one finger: a small error grows e-fold every {mm * push['divergence_length']:.1f} mm"
                )
        radii = {k: ("cannot steer" if r is None else f"{mm * r:.1f}") for k, r in push["radii"].items()}
        told = "; ".join(f"{k} {r}" for k, r in radii.items())
        if all(r is None for r in push["radii"].values()):
            told = "cannot steer under any assumption"
        typer.echo(f"  turning radius [mm]: {told}")
        known = [r for k, r in push["radii"].items() if r is not None and k != MIDDLE]
        if known and max(known) > 1.5 * min(known):
            typer.echo(
                f"  the radius depends on the assumption by a factor of {max(known) / min(known):.1f}:"
                " measure where the object presses on the table, or take a margin"
            )
