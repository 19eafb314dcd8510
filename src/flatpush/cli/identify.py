"""flatpush identify: limit surfaces from measured pairs of wrench and twist, or the table from motion alone."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .common import print_json, telling
from .recordings import COLUMNS, SKIP_BAD, UNITS, layout_of

if TYPE_CHECKING:
    from ..friction import Quartic
    from ..geometry.pose import Array

SMOOTH = ("ellipsoid", "quartic")
MODELS = ("auto", *SMOOTH, "loads", "mean")


def command(
    data: Annotated[
        list[Path],
        typer.Argument(
            metavar="DATA…",
            help="CSV files of wrenches and twists (fx,fy,tau,vx,vy,omega), or of poses of object and finger"
            " (t,x,y,theta,px,py); .mcap.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write the surface here, for a scene's surface: {file: …}; from motion the scene.",
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the surface with the data, or the comparison: .svg or .png."),
    ] = None,
    model: Annotated[
        str,
        typer.Option(
            metavar="MODEL",
            help="Write this: auto (the best), ellipsoid, quartic; loads, mean (-o scene.yaml).",
        ),
    ] = "auto",
    scene: Annotated[
        Path | None,
        typer.Option(metavar="SCENE", help="Also fit the loads on this scene's support; motion needs it."),
    ] = None,
    pool: Annotated[bool, typer.Option("--pool", help="One surface for all experiments together.")] = False,
    units: Annotated[
        str | None,
        typer.Option(
            metavar="UNITS",
            help=UNITS,
        ),
    ] = None,
    length: Annotated[
        float | None,
        typer.Option(
            metavar="METRES", help="Length that weighs angles against places; by default from the data."
        ),
    ] = None,
    folds: Annotated[int, typer.Option(metavar="N", help="Parts of the cross-validation.")] = 5,
    seeds: Annotated[
        int, typer.Option(metavar="N", help="How many cross-validations, each shuffled anew.")
    ] = 2,
    skip_bad: Annotated[bool, typer.Option("--skip-bad", help=SKIP_BAD)] = False,
    columns: Annotated[str, typer.Option(metavar="NAMES", help=COLUMNS)] = "",
    suggests: Annotated[
        bool, typer.Option("--suggest", help="From motion: the next three pushes that would teach most.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Fit limit surfaces to DATA and say how well they predict pushes that they have not seen; or, from poses of object
    and finger alone, where the object presses and the finger's friction."""
    from ..documents import check_outputs, is_motion_file, save_surface, scene_files

    if model not in MODELS:
        raise InputError(f"--model is one of {', '.join(MODELS)}", value=model)
    whole = output is not None and output.suffix.lower() in (".yaml", ".yml")
    if whole and scene is None:
        raise InputError("a scene is written from one", source=str(output), hint="--scene SCENE")
    if model in ("loads", "mean") and not whole:
        raise InputError(f"the model {model} is written as a scene", hint="--scene SCENE -o fitted.yaml")
    if seeds < 1:
        raise InputError("--seeds is at least 1", value=seeds)
    if folds < 2:
        raise InputError("--folds is at least 2", value=folds)
    if length is not None and not 0 < length < float("inf"):
        raise InputError("--length is positive and finite", value=length)
    check_outputs([*data, *(() if scene is None else scene_files(scene))], [output, figure])
    own = layout_of([] if scene is None else [scene], columns, units or "")[0]
    moves = [is_motion_file(path, own) for path in data]
    if any(moves):
        if not all(moves):
            raise InputError(
                "these files are of motion or of wrenches, not both", value=[str(p) for p in data]
            )
        if scene is None:
            raise InputError("friction from motion needs the object's outline", hint="--scene SCENE")
        if figure is not None:
            raise InputError("--figure draws surfaces from wrenches, not from motion")
        from .identify_motion import Asked, identify_motion

        return identify_motion(Asked(data, scene, output, units or "", columns, skip_bad, suggests, as_json))
    if columns or suggests:
        raise InputError("--columns and --suggest are for recordings of motion (t,x,y,theta,px,py)")
    if figure is not None:
        from ..view.picture import check_ending

        check_ending(figure)
    experiments, notes = _read(data, units or "m,rad", skip_bad, pool)
    if len(experiments) > 1 and output is not None:
        raise InputError(
            "a surface is written for one experiment",
            value=f"{len(experiments)} experiments",
            hint="--pool fits one surface to all of them.",
        )
    for note in notes:
        typer.echo(note, err=True)
    places = None if scene is None else _places(scene)
    found = []
    for pairs in experiments:
        with telling(f"fitting {pairs.name}"):
            found.append(_Found(pairs, places, length, folds, seeds, model, every=whole))
    if output is not None and scene is not None and whole:
        _write_scene(found[0], scene, output)
    elif output is not None:
        save_surface(found[0].surface, output)
    if figure is not None:
        with telling("drawing"):
            _draw(found, figure)
    if as_json:
        print_json({"experiments": [f.document() for f in found], "left_out": notes})
        return 0
    _tell(found)
    for path in (output, figure):
        if path is not None:
            typer.echo(f"wrote {path}")
    return 0


class _Found:
    """The fits of one experiment and how they were judged."""

    def __init__(
        self, pairs: Any, places: Any, length: float | None, folds: int, seeds: int, model: str, every: bool
    ) -> None:
        from ..friction import fit_ellipsoid, fit_loads, fit_quartic, sized
        from ..friction.cross_validation import Loads, Smooth, blended, choose, judge
        from ..friction.pairs import typical_length

        self.pairs = pairs
        self.length = length or typical_length(pairs.wrenches, pairs.twists)
        how: dict[str, Any] = {"length": self.length, "folds": folds}
        self.judged, self.weights, self.fits = {}, {}, {}
        for name, fit in (("ellipsoid", fit_ellipsoid), ("quartic", fit_quartic)):
            smooth = Smooth(name)  # type: ignore[arg-type]
            self.judged[name] = judge(pairs, smooth, seeds=range(seeds), **how)
            lam, beta = self.weights[name] = choose(pairs, smooth, **how)
            fitted = fit(pairs.wrenches, pairs.twists, regularisation=lam, force_weight=beta)
            self.fits[name] = sized(fitted, pairs.wrenches)
        self.loads = None
        if places is not None:
            loads = Loads(*places)
            self.judged["loads"] = judge(pairs, loads, seeds=range(seeds), **how)
            self.judged["mean"] = blended("mean", [self.judged["quartic"], self.judged["loads"]], pairs)
            self.trust = choose(pairs, loads, **how)
            self.loads = fit_loads(
                pairs.wrenches, pairs.twists, *places[:2], nominal=places[2], trust=self.trust
            )
        choices = list(self.judged) if every else SMOOTH
        self.model = min(choices, key=lambda name: self.judged[name].mean) if model == "auto" else model
        self.surface = self.fits[self.model if self.model in SMOOTH else "quartic"]
        self.beside = 0.0  # of a written mean, from the mean itself
        if self.model == "mean":
            self.surface, self.beside = self._mean()

    def _mean(self) -> "tuple[Quartic, float]":
        """A convex quartic fitted to the mean of the unit twists of quartic and loads, over wrenches all round, and the
        mean angle between the two on the measured wrenches [rad]."""
        import numpy as np

        from ..friction import fit_quartic
        from ..friction.report import twist_angles

        units = np.array([1.0, 1.0, self.length])
        models = (self.fits["quartic"], self.loads.surface) if self.loads else (self.fits["quartic"],)

        def mean(wrenches: "Array") -> "Array":
            twists = [m.twist(wrenches) * units for m in models]
            return np.sum([V / np.linalg.norm(V, axis=1, keepdims=True) for V in twists], axis=0) / units

        around = np.random.default_rng(0).normal(size=(200, 3)) * [1.0, 1.0, self.length]
        around = np.concatenate([around, self.pairs.wrenches])
        around /= self.fits["quartic"].value(around)[:, None] ** 0.25
        fitted = fit_quartic(around, mean(around), regularisation=0.001, force_weight=0.05)
        angles = twist_angles(fitted.twist(self.pairs.wrenches), mean(self.pairs.wrenches), self.length)
        return fitted, float(np.mean(angles))

    def document(self) -> dict[str, object]:
        from ..documents.surface_file import surface_form
        from ..view.angle_table import angle_numbers

        models: dict[str, Any] = {name: angle_numbers([j]) for name, j in self.judged.items()}
        for name in ("ellipsoid", "quartic"):
            lam, beta = self.weights[name]
            models[name] |= {
                "regularisation": lam,
                "force_weight": beta,
                "surface": surface_form(self.fits[name]),
            }
        if self.loads is not None:
            models["loads"] |= {
                "trust": self.trust,
                "shares": self.loads.shares.tolist(),
                "resistance": self.loads.resistance,
            }
        return {
            "name": self.pairs.name,
            "pairs": len(self.pairs),
            "length": self.length,
            "chosen": self.model,
            "against": self.pairs.against,
            "models": models,
        }


def _read(data: list[Path], units: str, skip_bad: bool, pool: bool) -> tuple[list[Any], list[str]]:
    import numpy as np

    from ..documents import load_pairs
    from ..friction.pairs import Pairs
    from .recordings import units_of

    parts = units_of(units)
    experiments: list[Any] = []
    notes: list[str] = []
    for path in data:
        file = load_pairs(path, length=parts[0], angle=parts[1], skip_bad=skip_bad)
        notes += [f"{path}: line {row.line} left out: {row.reason}" for row in file.left_out]
        if file.unended is not None:
            notes.append(
                f"{path}: no line break ends line {file.unended}; if the file was cut there, its last number is wrong"
            )
        experiments += file.experiments
    if pool and len(experiments) > 1:
        name = f"{len(experiments)} experiments together"
        wrenches = np.concatenate([e.wrenches for e in experiments])
        experiments = [Pairs(wrenches, np.concatenate([e.twists for e in experiments]), name)]
    for pairs in experiments:
        if pairs.against:
            notes.append(
                f"{pairs.name}: {pairs.against} of {len(pairs)} wrenches oppose their twist, which friction does not"
                " allow; a wrench is what the pusher applies to the object, about the same point as the twist"
            )
    return experiments, notes


def _places(scene: Path) -> Any:
    """Places, parts and nominal shares of the support of a scene, about its centre of friction."""
    import numpy as np

    from ..documents import load_scene
    from ..friction.loads import radial_parts
    from ..friction.pressure import Feet

    thing = load_scene(scene, unknown=True).object
    points, weights = thing.support.feet
    if isinstance(thing.support.pressure, Feet):
        return points - thing.cof, np.eye(len(weights)), weights
    if thing.support_word not in ("uniform", "unknown"):
        raise InputError(
            "loads are fitted on feet, or over the whole face (support: uniform or unknown)",
            source=str(scene),
            key="object.support",
        )
    return radial_parts(thing.outline.translated(-thing.cof))


def _write_scene(found: _Found, scene: Path, output: Path) -> None:
    """The scene with the model that was chosen: loads as its support, else a surface."""
    from ..documents import load_scene, save_fitted_scene

    note = f"{found.model} fitted to {len(found.pairs)} pairs of wrench and twist"
    if found.model == "loads" and found.loads is not None:
        support = found.loads.support.translated(load_scene(scene, unknown=True).object.cof)
        save_fitted_scene(scene, output, support=support, note=note)
    else:
        save_fitted_scene(scene, output, surface=found.surface, note=note)


def _tell(found: list[_Found]) -> None:
    from ..view.angle_table import angle_table

    typer.echo(
        "Angle between predicted and measured twist of pushes left out; weights chosen inside each training part."
    )
    typer.echo(angle_table({f.pairs.name: f.judged for f in found}))
    if len(found) > 1:
        wins = sum(f.judged["quartic"].mean < f.judged["ellipsoid"].mean for f in found)
        typer.echo(f"quartic better than ellipsoid in {wins} of {len(found)}")
    for f in found:
        weights = ", ".join(
            f"{name} λ = {w[0]:g}, β = {w[1]:g}" for name, w in f.weights.items() if name != "loads"
        )
        typer.echo(f"{f.pairs.name}: ℓ = {1000 * f.length:.1f} mm, {weights}; chosen: {f.model}")
        if f.model == "mean":
            typer.echo(
                f"  written as a quartic that is {math.degrees(f.beside):.1f}° from the mean on these pushes"
            )
        if f.loads is not None:
            shares = ", ".join(f"{share:.3f}" for share in f.loads.shares)
            typer.echo(f"  loads {shares} of the whole; friction × load {f.loads.resistance:.2f} N")


def _draw(found: list[_Found], path: Path) -> None:
    if len(found) > 1:
        from ..view.angle_figure import angle_figure

        angle_figure(
            {f.pairs.name: f.judged for f in found}, path, title="How far predicted twists are off",
            subtitle="pushes left out; weights chosen inside each training part",
        )  # fmt: skip
        return
    from ..view.surface_figure import surface_figure

    f = found[0]
    first = f.model if f.model in SMOOTH else "quartic"
    names = sorted(SMOOTH, key=lambda name: name != first)
    surfaces: dict[str, Any] = {name: (f.fits[name], 1.0) for name in names}
    if f.loads is not None:
        surfaces["loads"] = (f.loads.surface, f.loads.resistance)
    surface_figure(
        surfaces, f.pairs, f.length, path, title=f"Limit surfaces of {f.pairs.name}, {len(f.pairs)} pushes",
        subtitle=f"in space: the {first} with all pushes; ℓ = {1000 * f.length:.1f} mm",
    )  # fmt: skip
