"""flatpush camera as a user runs it: pictures to a camera file, poses of a block, a log that identify reads, a tag."""

import csv
import json
import re
import sys

import numpy as np
import pytest
from tests.extras import extra

pytest.importorskip("cv2", reason=extra("vision"))
pytest.importorskip("pyapriltags", reason=extra("vision"))

import cv2

from flatpush.cli.app import main
from flatpush.documents.camera_file import load_camera, save_camera
from flatpush.documents.motion_file import load_motions
from flatpush.vision.tags import cells, detect
from flatpush.vision.worn import Tag

from ..drawn_camera import SHEET, SIDES, over, sheets, watching

POSE = np.array([0.04, -0.03, 0.5])
OBJECT, FINGER = "3,30,20,3,-2,11.459", "7,20,50"


@pytest.fixture
def flatpush(monkeypatch, capsys):
    """Runs the program within this process: status, standard output and standard error."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["flatpush", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        told = capsys.readouterr()
        return ended.value.code, told.out, told.err

    return run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A camera file, and pictures of a block that moves with a finger behind it."""
    path = tmp_path_factory.mktemp("camera")
    camera = over()
    save_camera(camera, 0.1, path / "camera.json")
    drawn = watching(camera)
    drawn = watching(camera, {**drawn.tags, "finger": Tag(7, 0.02, 0.05)})
    for k in range(3):
        poses = {
            "object": POSE + np.array([0.001 * k, 0, 0]),
            "finger": np.array([-0.05 + 0.001 * k, 0.03, 0.0]),
        }
        cv2.imwrite(str(path / f"{k}.png"), drawn.picture(poses))
    return path


def pictures(folder, count=3):
    return [str(folder / f"{k}.png") for k in range(count)]


def test_pictures_of_a_sheet_make_a_camera_file(tmp_path, flatpush):
    for k, picture in enumerate(sheets()):
        cv2.imwrite(str(tmp_path / f"{k}.png"), picture)
    said = [
        part
        for number, size, X in SHEET
        for part in ("--fiducial", f"{number},{1000 * size},{1000 * X[0]},{1000 * X[1]},{np.degrees(X[2])}")
    ]
    names = pictures(tmp_path, len(SIDES))
    status, told, error = flatpush("camera", "calibrate", *names, *said, "-o", tmp_path / "camera.json")
    assert status == 0, error
    assert re.search(r"4 pictures, points 0\.0\d+ pixels", told)
    found, true = load_camera(tmp_path / "camera.json"), over(SIDES[0][0])
    there = true.pixels([0.1, 0.05, 0.0])
    assert np.allclose(found.on_plane(there), [0.1, 0.05], atol=6e-5)
    status, _, error = flatpush("camera", "calibrate", *names[:2], *said, "-o", tmp_path / "other.json")
    assert status == 2
    assert "2 of 2 pictures show the target, and 3 or more" in error
    same = [names[1]] * 4 + names[:1]
    status, _, error = flatpush("camera", "calibrate", *same, *said, "-o", tmp_path / "other.json")
    assert status == 2
    assert "only 2 of 5 pictures differ" in error
    assert not (tmp_path / "other.json").exists()
    board = ("--board", "9x6,1e300", "-o", tmp_path / "other.json")
    assert "fields of 0.1 to 1000 mm" in flatpush("camera", "calibrate", *names, *board)[2]


def test_watch_prints_poses_and_writes_a_log_that_identify_reads(folder, tmp_path, flatpush):
    log = tmp_path / "log.csv"
    status, text, error = flatpush(
        "camera", "watch", *pictures(folder), "--camera", folder / "camera.json", "--tag", OBJECT,
        "--finger", FINGER, "--log", log, "--json",
    )  # fmt: skip
    assert status == 0, error
    told = json.loads(text)
    assert told["seen"] == 3
    assert np.allclose(told["rows"][2]["object"]["pose"], POSE + np.array([0.002, 0, 0]), atol=2e-4)
    (motion,) = load_motions(log).motions
    assert np.allclose(motion.tips, [[-0.05 + 0.001 * k, 0.03] for k in range(3)], atol=1e-4)
    assert np.allclose(motion.poses[1], POSE + np.array([0.001, 0, 0]), atol=(5e-5, 5e-5, 1e-3))
    with log.open() as file:
        assert float(next(csv.DictReader(file))["sd_x [m]"]) < 1e-4
    watched = flatpush(
        "camera", "watch", *pictures(folder, 1), "--camera", folder / "camera.json", "--tag", OBJECT
    )
    assert "object (40.0" in watched[1]
    assert "1 of 1 frames show the object" in watched[1]


def test_bad_input_is_one_line(folder, tmp_path, flatpush):
    mirrored = cv2.imread(str(folder / "0.png"))[:, ::-1]
    for k in range(3):
        cv2.imwrite(str(tmp_path / f"m{k}.png"), mirrored)
    (tmp_path / "broken.png").write_bytes(b"no picture")
    camera = ["--camera", str(folder / "camera.json")]
    for arguments, says in (
        ([*pictures(folder), *camera, "--tag", "3,25,20"], "picture 1: tag 3 looks 30"),
        ([str(tmp_path / f"m{k}.png") for k in range(3)] + [*camera, "--tag", OBJECT], "mirrored"),
        ([*pictures(folder, 1), *camera, "--tag", "3,30,20,1e300,0,0"], "at most 100 m"),
        ([str(tmp_path / "broken.png"), *camera, "--tag", OBJECT], "broken.png: this file holds no picture"),
        ([*pictures(folder), *camera, "--tag", OBJECT, "--finger", "3,20,50"], "two objects have one tag"),
        ([*pictures(folder), "--camera", str(folder / "0.png"), "--tag", OBJECT], "not text"),
        ([*pictures(folder), *camera, "--tag", "3,25"], "takes 3 numbers"),
        ([*pictures(folder), *camera, "--tag", "1000,30,20"], "a number from 0 to 586"),
        ([*pictures(folder), *camera, "--tag", OBJECT, "--latency", "-1"], "--latency is a finite number"),
        (["97", *camera, "--tag", OBJECT], "there is no such camera"),
    ):
        status, _, error = flatpush("camera", "watch", *arguments)
        assert status == 2
        assert says in error
        assert [line.startswith("error:") for line in error.splitlines()].count(True) == 1


def boxes_of_pdf(path):
    """The rectangles of a sheet in mm from the lower left corner, as a PDF reader would draw them."""
    text = path.read_bytes().decode("latin-1")
    numbers = re.findall(r"([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+) re", text)
    return np.array(numbers, dtype=float) * 25.4 / 72


def test_a_printed_tag_is_to_scale_and_is_that_tag(tmp_path, flatpush):
    """The rectangles of the PDF, filled ten times a mm, are read by the detector."""
    status, _, error = flatpush("camera", "tag", "5", "-o", tmp_path / "tag.pdf", "--size", "40")
    assert status == 0, error
    page = np.full((2970, 2100), 255, np.uint8)
    boxes = boxes_of_pdf(tmp_path / "tag.pdf")
    for x, y, w, h in boxes:
        top, left = 2970 - 10 * (y + h), 10 * x
        page[round(top) : round(top + 10 * h), round(left) : round(left + 10 * w)] = 0
    (seen,) = detect(page)
    assert seen.id == 5
    assert np.linalg.norm(seen.corners[1] - seen.corners[0]) == pytest.approx(400, abs=1)
    assert seen.corners[0][0] < seen.corners[1][0]  # upright
    ruler = max(boxes, key=lambda box: box[2])
    assert ruler[2] == pytest.approx(100, abs=1e-3)
    raw = (tmp_path / "tag.pdf").read_bytes()
    assert int(re.search(rb"startxref\n(\d+)", raw)[1]) == raw.index(b"xref\n0 6")
    assert flatpush("camera", "tag", "5", "-o", tmp_path / "tag.svg", "--size", "40")[0] == 0
    svg = (tmp_path / "tag.svg").read_text()
    drawn = np.array(
        re.findall(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)"/>', svg), float
    )
    assert np.allclose(drawn[:, [0, 2, 3]], boxes[:, [0, 2, 3]], atol=1e-3)
    assert cells(5)[1:9, 1:9].any()


def test_without_the_extra_a_line_says_what_to_install(folder, monkeypatch, flatpush):
    from flatpush.vision import tags

    for name in ("cv2", "pyapriltags"):
        monkeypatch.setitem(sys.modules, name, None)
    tags._detector.cache_clear()
    tags._codes.cache_clear()
    status, _, error = flatpush("camera", "tag", "5", "-o", folder / "no.pdf")
    assert status == 2
    assert 'pip install "flatpush[vision]"' in error
    assert not (folder / "no.pdf").exists()
