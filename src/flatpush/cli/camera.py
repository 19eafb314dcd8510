"""flatpush camera: a camera over the table: its calibration, what it sees, and tags to print."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .common import check_latency, numbers, pose_text, print_json

if TYPE_CHECKING:
    from ..vision.eyes import Frame
    from ..vision.tracker import Seen, Tracker
    from ..vision.worn import Tag

app = typer.Typer(
    name="camera", help="A camera over the table: its calibration, what it sees, and tags to print.",
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip

# Pictures without the tag after which it is said that they may be mirrored.
PATIENT = 3


@app.command("calibrate")
def calibrate_command(
    images: Annotated[
        list[Path],
        typer.Argument(metavar="IMAGES…", help="Pictures of the board or the fiducials, three or more."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The camera file (JSON).")],
    board: Annotated[
        str | None,
        typer.Option(
            metavar="COLSxROWS,MM", help="A checkerboard: its inner corners and the side of a field."
        ),
    ] = None,
    fiducial: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID,MM,X,Y,DEG", help="A tag by its number, size and place; as often as needed [mm, deg]."
        ),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option(
            metavar="IMAGE", help="The picture in which the target lies on the table; by default the first."
        ),
    ] = None,
    origin: Annotated[
        str, typer.Option(metavar="X,Y,DEG", help="Where the target's frame is on the table [mm, deg].")
    ] = "0,0,0",
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Find lens and table of a camera from IMAGES of a checkerboard, or of tags at known places."""
    import numpy as np

    from ..documents import check_outputs
    from ..documents.camera_file import save_camera
    from ..vision.calibrate import Board, Fiducials, calibrate
    from ..vision.sources import read_picture
    from ..vision.worn import Tag

    check_outputs([*images, table], [output])
    if (board is None) == (not fiducial):
        raise InputError("a camera is calibrated with either --board or --fiducial")
    target: Board | Fiducials
    if board is not None:
        try:
            fields, side = board.split(",")
            columns, rows = (int(n) for n in fields.lower().split("x"))
            target = Board(columns, rows, float(side) / 1000)
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise InputError("--board takes COLSxROWS,MM, such as 9x6,25", value=board) from None
    else:
        given = [numbers(text, 5, "--fiducial") or [] for text in fiducial or ()]
        target = Fiducials(
            [
                Tag(_whole(n), size / 1000, 0.0, np.array([x / 1000, y / 1000, math.radians(turn)]))
                for n, size, x, y, turn in given
            ]
        )
    place = numbers(origin, 3, "--origin") or []
    names = [*images, *([table] if table is not None and table not in images else [])]
    pictures = [(str(path), read_picture(path)) for path in names]
    first = 0 if table is None else names.index(table)
    X = np.array([place[0] / 1000, place[1] / 1000, math.radians(place[2])])
    found = calibrate(pictures, target, first, X)
    save_camera(found.camera, found.rms, output)
    eye = found.camera.position
    if as_json:
        print_json(
            {
                "used": found.used, "unseen": list(found.unseen), "rms": found.rms, "table_rms": found.table_rms,
                "table_error": found.table_error, "focal": found.camera.focal.tolist(),
                "focal_sd": found.focal_sd, "position": eye.tolist(), "output": str(output),
            }
        )  # fmt: skip
        return 0
    for name in found.unseen:
        typer.echo(f"{name}: the target is not seen; left out", err=True)
    f = found.camera.focal
    typer.echo(
        f"{found.used} pictures, points {found.rms:.3f} pixels from their places (root mean square); focal lengths"
        f" {f[0]:.1f} and {f[1]:.1f} pixels ± {100 * found.focal_sd:.2f} %"
    )
    typer.echo(
        f"table: {found.table_rms:.3f} pixels, {1000 * found.table_error:.3f} mm; the camera is at"
        f" ({1000 * eye[0]:.1f}, {1000 * eye[1]:.1f}, {1000 * eye[2]:.1f}) mm"
    )
    typer.echo(f"wrote {output}")
    return 0


@app.command("watch")
def watch_command(
    source: Annotated[
        list[str],
        typer.Argument(
            metavar="SOURCE…", help="The number of a camera, a video, or pictures in their order."
        ),
    ],
    camera: Annotated[Path, typer.Option(metavar="FILE", help="The camera file.")],
    tag: Annotated[
        str,
        typer.Option(
            metavar="ID,MM,HEIGHT[,X,Y,DEG]",
            help="The object's tag: number, size, height over the table, and place in the object's frame [mm, deg].",
        ),
    ],
    finger: Annotated[
        str | None, typer.Option(metavar="ID,MM,HEIGHT[,X,Y,DEG]", help="The finger's tag, in the same way.")
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write poses as .csv, which identify reads if the finger is seen."),
    ] = None,
    rate: Annotated[float, typer.Option(metavar="HZ", help="How often pictures in files were taken.")] = 30.0,
    latency: Annotated[
        float, typer.Option(metavar="SECONDS", help="How old a camera's frame is when it comes.")
    ] = 0.0,
    frames: Annotated[int | None, typer.Option(metavar="N", help="Stop after so many frames.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> int:
    """Print where an object is in the frames of SOURCE, by its tag, until they end or Ctrl-C."""
    from ..documents import check_outputs, write_atomically
    from ..documents.camera_file import load_camera
    from ..vision.calibrate import check_mirrored
    from ..vision.tracker import Tracker

    live = len(source) == 1 and source[0].isdigit()
    check_outputs([camera, *([] if live else [Path(name) for name in source])], [log])
    if not (math.isfinite(rate) and rate > 0):
        raise InputError("--rate is positive and finite", value=rate)
    check_latency(latency)
    worn = {"object": tag_of(tag, "--tag")}
    if finger is not None:
        worn["finger"] = tag_of(finger, "--finger")
    tracker = Tracker(load_camera(camera), worn)
    state, rows, missed = tracker.start(), list[Any](), 0
    try:
        with _frames(source, live, tracker, rate, latency) as stream:
            for frame in stream:
                state, seen = tracker.step(state, frame.picture, frame.stamp)
                rows.append(_row(seen, tracker, state.objects))
                if not as_json:
                    typer.echo(_line(rows[-1]))
                missed = 0 if "object" in seen.sightings else missed + 1
                if missed == PATIENT and len(rows) == PATIENT:
                    check_mirrored(frame.picture, [worn["object"].number])
                if len(rows) == frames:
                    break
    except KeyboardInterrupt:
        if not live:
            raise
    finally:
        if log is not None and rows:
            write_atomically(log, _csv(rows))
    good = sum(row["object"] is not None for row in rows)
    if as_json:
        print_json({"frames": len(rows), "seen": good, "rows": rows})
    else:
        typer.echo(f"{good} of {len(rows)} frames show the object")
        if log is not None:
            typer.echo(f"wrote {log}")
    return 0


@app.command("tag")
def tag_command(
    number: Annotated[int, typer.Argument(metavar="ID", help="The number of the tag, from 0 to 586.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="Write .pdf or .svg.")],
    size: Annotated[float, typer.Option(metavar="MM", help="Side of the black square.")] = 30.0,
) -> int:
    """Write a tag of the family tag36h11 to print to scale, with a ruler."""
    from ..documents import check_outputs, write_atomically
    from ..vision.sheet import as_pdf, as_svg, sheet

    check_outputs([], [output])
    kind = output.suffix.lower()
    if kind not in (".pdf", ".svg"):
        raise InputError("a tag is written as .pdf or .svg", source=str(output))
    page = sheet(number, size / 1000)
    write_atomically(output, as_pdf(page) if kind == ".pdf" else as_svg(page))
    typer.echo(f"wrote {output}: tag {number}, {size:g} mm; print at 100 % and measure")
    return 0


def tag_of(text: str, option: str) -> Tag:
    """A tag of the command line: ID,MM,HEIGHT[,X,Y,DEG]."""
    import numpy as np

    from ..vision.worn import Tag

    values = numbers(text, 6 if text.count(",") > 2 else 3, option) or []
    number, size, height, x, y, turn = values if len(values) == 6 else [*values, 0.0, 0.0, 0.0]
    place = np.array([x / 1000, y / 1000, math.radians(turn)])
    return Tag(_whole(number), size / 1000, height / 1000, place)


def _whole(value: float) -> int:
    if value != int(value) or value < 0:
        raise InputError("the number of a tag is 0, 1, 2, …", value=value)
    return int(value)


@contextmanager
def _frames(
    source: Sequence[str], live: bool, tracker: Tracker, rate: float, latency: float
) -> Iterator[Iterator[Frame]]:
    from ..vision.sources import Device, recorded

    if not live:
        yield recorded(source, rate)
        return

    def coming(device: Device) -> Iterator[Frame]:
        while True:
            yield from device.taken(time.monotonic())
            time.sleep(0.002)

    with Device(int(source[0]), latency, tracker.camera.size) as device:
        yield coming(device)


def _row(seen: Seen, tracker: Tracker, objects: Any) -> dict[str, Any]:
    """What one frame showed, in SI: the pose as seen and as filtered, with standard deviations."""
    row: dict[str, Any] = {"frame": seen.number, "time": seen.stamp}
    for name in tracker.tags:
        one, track = seen.sightings.get(name), objects[name].track
        row[name] = None
        if one is not None:
            sd = [math.sqrt(v) for v in one.covariance.diagonal()]
            row[name] = {
                "pose": one.pose.tolist(),
                "sd": sd,
                "filtered": track.pose.tolist(),
                "twist": track.twist.tolist(),
            }
        elif name in seen.notes:
            row[f"{name}_note"] = seen.notes[name]
    return row


def _line(row: dict[str, Any]) -> str:
    parts = [f"{row['frame']:5d} {row['time']:9.3f} s"]
    for name in ("object", "finger"):
        if row.get(name):
            sd = row[name]["sd"]
            parts.append(
                f"{name} {pose_text(row[name]['pose'])} ± {1000 * math.hypot(sd[0], sd[1]):.3f} mm,"
                f" {math.degrees(sd[2]):.3f}°"
            )
        elif f"{name}_note" in row:
            parts.append(f"{name}: {row[f'{name}_note']}")
    return "  ".join(parts)


def _csv(rows: Sequence[dict[str, Any]]) -> str:
    finger = "finger" in rows[0]
    names = ["t [s]", "x [m]", "y [m]", "theta [rad]", *(["px [m]", "py [m]"] if finger else [])]
    lines = [",".join([*names, "sd_x [m]", "sd_y [m]", "sd_theta [rad]"])]
    for row in rows:
        # A row counts only if object and finger were seen.
        there = row["object"] is not None and (not finger or row["finger"] is not None)
        values = [row["time"], *([""] * (8 if finger else 6))]
        if there:
            tip = row["finger"]["pose"][:2] if finger else []
            values = [row["time"], *row["object"]["pose"], *tip, *row["object"]["sd"]]
        lines.append(",".join(repr(v) if v != "" else "" for v in values))
    return "\n".join(lines) + "\n"
