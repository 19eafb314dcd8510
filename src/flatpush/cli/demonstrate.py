"""flatpush demonstrate: episodes of our planner as a data set for learners."""

from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError, MissingExtra
from .common import print_json

if TYPE_CHECKING:
    from .cluster import Mapper

DOUBTFUL = 8  # blocks without an episode, after which it gives up


def command(
    scenes: Annotated[list[Path], typer.Argument(metavar="SCENES", help="Scene files with one finger.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="The folder of the data set.")
    ],
    count: Annotated[int, typer.Option("-n", "--count", metavar="N", help="How many episodes.")] = 100,
    seed: Annotated[
        int,
        typer.Option(metavar="N", help="Seed of all that is random; the same seed gives the same episodes."),
    ] = 0,
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="How many processes; by default the machine's cores.")
    ] = None,
    also: Annotated[
        list[str] | None,
        typer.Option(metavar="FORM", help="gymnasium or mcap: each episode as a file of that form as well."),
    ] = None,
    on_cluster: Annotated[
        bool, typer.Option("--cluster", help="Spread the episodes over a local Dask cluster.")
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Spread them over the Dask cluster at this address."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Push objects of SCENES to random goals and write verified episodes as a LeRobot v3.0 data set; goes on with one
    that was broken off."""
    from ..documents import load_scene

    for name, value in (("--count", count), ("--workers", 1 if workers is None else workers)):
        if value < 1:
            raise InputError("a number of 1 or more is needed", key=name, value=value)
    if seed < 0:
        raise InputError("a seed is 0 or more", key="--seed", value=seed)
    from .cluster import check_address

    check_address(scheduler)
    asked = [load_scene(scene) for scene in scenes]
    try:
        from ..gym.demonstrations import blocks, check_scenes
    except ImportError:
        raise MissingExtra('demonstrations need Gymnasium: pip install "flatpush[demonstrations]"') from None
    from ..gym.lerobot import LeRobotFolder, load
    from ..gym.trajectories import FORMS

    load()
    forms = [form for form in FORMS if form in (also or [])]
    if unknown := sorted(set(also or []) - set(FORMS)):
        raise InputError(f"forms are {' and '.join(FORMS)}", key="--also", value=unknown)
    if "mcap" in forms:
        from ..execution.bag import load as load_bags

        load_bags()
    check_scenes(asked)
    folder = LeRobotFolder(output, seed, forms)
    began, empty = folder.episodes, 0
    where: AbstractContextManager[Mapper | None] = nullcontext()
    if on_cluster or scheduler is not None:
        from .cluster import cluster

        where = cluster(scheduler)
    if folder.episodes < count:
        with where as spread, closing(blocks(asked, seed, folder.blocks, workers, spread)) as made:
            for block in made:
                folder.add(block, count - folder.episodes)
                empty = 0 if block.episodes else empty + 1
                typer.echo(f"{folder.episodes} of {count} episodes, {folder.frames} frames", err=True)
                if folder.episodes >= count:
                    break
                if empty >= DOUBTFUL:
                    typer.echo(f"no episode in {empty} objects reached its goal; see flatpush plan", err=True)
                    return 3
    result = {"episodes": folder.episodes, "frames": folder.frames, "new": folder.episodes - began}
    if as_json:
        print_json(result)
    else:
        typer.echo(f"{output}: {folder.episodes} episodes, {folder.frames} frames; {result['new']} are new")
    return 0
