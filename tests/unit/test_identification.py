"""Surfaces from data: pairs from files, loads at known places, cross-validation, and the command around them."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.command_line import flatpush

from flatpush.documents import load_pairs, load_scene, load_surface
from flatpush.errors import InputError
from flatpush.friction import Ellipsoid, Exact, Support, fit_loads
from flatpush.friction.cross_validation import (
    Judgement,
    Known,
    Loads,
    Smooth,
    blended,
    choose,
    interval,
    judge,
    least_pairs,
    parts_of,
)
from flatpush.friction.loads import equilibrium, radial_parts
from flatpush.friction.pairs import Pairs
from flatpush.friction.report import twist_angles
from flatpush.geometry import Outline

FEET = np.array([(-0.03, -0.02), (0.04, -0.01), (0.0, 0.03)])
LENGTH = 0.03


def twists(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, 3)) * [1.0, 1.0, 1 / LENGTH]


def pairs(n: int = 40, noise: float = 0.0, weights=(5, 2, 3), seed: int = 0) -> Pairs:
    V = twists(n, seed)
    F = Support.points(FEET, weights).wrench(V, friction=0.3, load=10)
    F = F + noise * np.random.default_rng(seed + 1).normal(size=F.shape) * [1, 1, LENGTH]
    return Pairs(F, V, "three feet")


# Loads


def test_loads_are_found_in_spite_of_a_few_wild_wrenches() -> None:
    """The residuals count by their size, not its square: five wild pairs of forty move no load by more than 0.02."""
    data = pairs()
    F = data.wrenches.copy()
    F[:5] = np.random.default_rng(3).normal(size=(5, 3)) * [3, 3, 3 * LENGTH]
    found = fit_loads(F, data.twists, FEET)
    np.testing.assert_allclose(found.shares, [0.5, 0.2, 0.3], atol=0.02)
    assert found.resistance == pytest.approx(3.0, rel=0.03)


def test_trust_blends_the_data_with_what_was_expected() -> None:
    data = pairs()
    for trust in (0.0, 0.25, 1.0):
        shares = fit_loads(data.wrenches, data.twists, FEET, nominal=[1, 1, 1], trust=trust).shares
        np.testing.assert_allclose(shares, (1 - trust) * np.array([0.5, 0.2, 0.3]) + trust / 3, atol=1e-6)


def test_a_radial_density_is_found_again() -> None:
    places, parts, uniform = radial_parts(Outline.polygon([(-0.05, -0.05), (0.1, -0.05), (-0.05, 0.1)]))
    assert uniform.sum() == pytest.approx(1.0)
    weights = parts / parts.sum(axis=0) @ [0.0, 0.1, 0.5, 0.3, 0.1]
    V = twists(60)
    found = fit_loads(Support.points(places, weights).wrench(V), V, places, parts, nominal=uniform)
    np.testing.assert_allclose(found.shares, [0.0, 0.1, 0.5, 0.3, 0.1], atol=1e-4)


def test_loads_in_equilibrium() -> None:
    np.testing.assert_allclose(equilibrium(FEET) @ FEET, 0, atol=1e-9)
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    np.testing.assert_allclose(equilibrium(square), 0.25, atol=1e-9)
    with pytest.raises(InputError, match="between the feet"):
        equilibrium(square, (3, 0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"trust": 2.0}, "between 0 and 1"),
        ({"trust": 0.5}, "no nominal loads"),
        ({"nominal": [1, -1, 1]}, "none negative"),
        ({"parts": np.zeros((3, 1))}, "spread over the places"),
        ({"places": [1.0, 2.0]}, r"list of \[x, y\]"),
        ({"n": 3}, "at least 4 pairs, got 3"),
        ({"sign": -1.0}, "oppose the twists"),
    ],
)
def test_loads_that_cannot_be_fitted(change: dict, message: str) -> None:
    n, sign, places = change.pop("n", 20), change.pop("sign", 1.0), change.pop("places", FEET)
    data = pairs(n)
    with pytest.raises(InputError, match=message):
        fit_loads(sign * data.wrenches, data.twists, places, **change)


# Cross-validation


def test_a_pair_never_touches_the_fit_that_predicts_it() -> None:
    """A model that remembers its pairs: what it predicts for one is a pair of another part, and weights are chosen
    on training pairs only."""

    class Memory(Smooth):
        def fit(self, pairs, choice):
            known = {tuple(F) for F in pairs.wrenches}

            class Twist:
                def twist(self, wrench):
                    assert not any(tuple(F) in known for F in np.atleast_2d(wrench))
                    return np.ones_like(wrench)

            return Twist()

    judged = judge(pairs(30), Memory("ellipsoid"), length=LENGTH, seeds=(0, 1))
    assert judged.angles.shape == (2, 30)


def test_the_parts_hold_each_pair_once() -> None:
    parts = parts_of(23, 5, seed=1)
    assert sorted(np.concatenate(parts).tolist()) == list(range(23))
    assert {len(part) for part in parts} == {4, 5}


def test_models_are_judged_as_they_deserve() -> None:
    """Data of three feet with 5 % noise: the feet themselves predict best, then the quartic, then the ellipsoid."""
    data = pairs(50, noise=0.1)
    models = [
        Known(Exact(Support.points(FEET, [5, 2, 3]))),
        Loads(FEET, np.eye(3), np.ones(3) / 3),
        Smooth("quartic", ((0.001, 0.2),)),
        Smooth("ellipsoid", ((0.001, 0.2),)),
    ]
    judged = [judge(data, model, length=LENGTH, seeds=(0,)) for model in models]
    means = [j.mean for j in judged]
    assert means == sorted(means)
    low, high = interval(judged[:1], np.mean)
    assert low < judged[0].mean < high
    both = blended("mean", judged[1:3], data)
    assert both.mean <= max(means[1:3])
    np.testing.assert_allclose(np.linalg.norm(both.twists, axis=2), 1.0)


def test_the_choice_is_the_one_that_predicts_best() -> None:
    loads = Loads(FEET, np.eye(3), np.array([1.0, 1.0, 1.0]) / 3)
    assert choose(pairs(), loads, length=LENGTH) == 0.0  # exact data contradict equal loads
    equal = pairs(12, noise=1.5, weights=(1, 1, 1))
    assert choose(equal, loads, length=LENGTH) > 0.0


def test_an_interval_covers_the_mean_of_a_known_distribution() -> None:
    """Of 200 samples of 40 angles from an exponential distribution, 95 % intervals hold the mean 93 ± 5 % of the
    time (percentile intervals of skew samples are a little short)."""
    rng, held = np.random.default_rng(0), 0
    for _ in range(200):
        j = Judgement("", np.zeros((1, 40, 3)), rng.exponential(size=(1, 40)), 1.0)
        low, high = interval([j], np.mean)
        held += low <= 1.0 <= high
    assert 0.88 <= held / 200 <= 0.98


def test_too_few_pairs_are_refused_with_the_number_needed() -> None:
    needed = least_pairs(Smooth("quartic"), 5)
    with pytest.raises(InputError, match=rf"three feet: 5-fold .* at least {needed} pairs, got {needed - 1}"):
        judge(pairs(needed - 1, noise=0.05), Smooth("quartic"), length=LENGTH)
    model = Smooth("quartic", ((0.01, 0.2), (0.001, 0.2)))
    judged = judge(pairs(needed, noise=0.05), model, length=LENGTH, seeds=(0,))
    assert 0 < judged.mean < np.pi / 2


# Files


HEADER = "fx [N],fy [N],tau [N mm],vx [mm/s],vy [mm/s],omega [deg/s]"


def write(path: Path, rows: list[str], header: str = HEADER) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def table(data: Pairs) -> list[str]:
    scale = np.array([1, 1, 1000, 1000, 1000, 180 / np.pi])
    return [",".join(f"{x:.9g}" for x in row) for row in np.hstack([data.wrenches, data.twists]) * scale]


def test_units_stand_in_the_header_or_are_given(tmp_path) -> None:
    data = pairs(8)
    named = load_pairs(write(tmp_path / "named.csv", table(data))).experiments[0]
    given = load_pairs(
        write(tmp_path / "given.csv", table(data), "fx,fy,tau,vx,vy,omega"), length="mm", angle="deg"
    ).experiments[0]
    for read in (named, given):
        np.testing.assert_allclose(read.wrenches, data.wrenches, rtol=1e-8)
        np.testing.assert_allclose(read.twists, data.twists, rtol=1e-8)
    assert named.name == "named"
    assert named.rows == tuple(range(2, 10))


def test_the_recorded_sets_are_read_as_they_are(data_folder) -> None:
    file = load_pairs(data_folder / "icra_sensor" / "pushes_all.csv")
    assert next((e.name, len(e), e.against) for e in file.experiments) == ("hardboard 3pts1", 50, 0)
    assert len(file.experiments) == 7
    assert file.left_out == ()


BAD = [
    ("1,2,3,4", "line 3: it has 4 of 6 columns"),
    ("1,2,nan,4,5,6", "line 3: tau is not finite"),
    ("1,2,3,4,5,inf", "line 3: omega is not finite"),
    ("1,2,three,4,5,6", "line 3: tau is not a number"),
    ("1,,3,4,5,6", "line 3: fy is not a number"),
    ("0,0,0,4,5,6", "line 3: the wrench is zero"),
    ("1,2,3,0,0,0", "line 3: the object does not move"),
]


@pytest.mark.parametrize(("row", "message"), BAD, ids=[message[8:] for _, message in BAD])
def test_a_bad_row_is_named_and_never_used_silently(tmp_path, row, message) -> None:
    path = write(tmp_path / "pushes.csv", ["1,2,3,4,5,6", row, "6,5,4,3,2,1"])
    with pytest.raises(InputError, match=message):
        load_pairs(path)
    file = load_pairs(path, skip_bad=True)
    assert len(file.experiments[0]) == 2
    assert file.experiments[0].rows == (2, 4)
    assert [row.line for row in file.left_out] == [3]


def test_stamps_rise_within_an_experiment(tmp_path) -> None:
    rows = ["a,0.1", "a,0.2", "b,0.1", "a,0.2", "a,0.15", "b,0.3"]
    path = write(
        tmp_path / "s.csv",
        [f"{row},1,2,3,4,5,6" for row in rows],
        "experiment,t,fx,fy,tau,vx,vy,omega",
    )
    with pytest.raises(
        InputError,
        match=r"2 rows .*line 5: its stamp 0.2 repeats that of line 3; line 6: .*runs back.*of line 3",
    ):
        load_pairs(path)
    file = load_pairs(path, skip_bad=True)
    assert [len(e) for e in file.experiments] == [2, 2]
    assert [row.line for row in file.left_out] == [5, 6]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("fx,fy,tau,vx,vy\n1,2,3,4,5\n", "names no column omega"),
        ("fx,fx,tau,vx,vy,omega\n", "two columns have the name 'fx'"),
        ("fx [lb],fy,tau,vx,vy,omega\n1,1,1,1,1,1\n", "unit of column fx is not known, got 'lb'"),
        (f"{HEADER}\n", "no usable pair"),
        (f'{HEADER}\n1,2,3,4,5,"6\n', "not CSV"),
    ],
)
def test_files_that_are_no_table_of_pairs(tmp_path, text, message) -> None:
    path = tmp_path / "pushes.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_pairs(path)


def test_a_last_line_without_an_end_is_remarked_on(tmp_path) -> None:
    path = tmp_path / "pushes.csv"
    path.write_text(f"{HEADER}\n1,2,3,4,5,6\n1,2,3,4,5,6", encoding="utf-8")
    assert load_pairs(path).unended == 3


# The command


def called(*arguments: str) -> tuple[int, str, str]:
    ended = flatpush(*arguments)
    return ended.returncode, ended.stdout, ended.stderr


@pytest.mark.slow
def test_identify_writes_a_surface_that_a_scene_can_name(tmp_path) -> None:
    path = write(tmp_path / "three feet.csv", table(pairs(30, noise=0.02)))
    scene = tmp_path / "scene.yaml"
    feet = [[*foot, w] for foot, w in zip(FEET.tolist(), [5, 2, 3], strict=True)]
    outline = "[[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]"
    text = f"flatpush: scene/1\nobject: {{outline: {outline}, friction: 0.3, support: {{points: {feet}}}"
    scene.write_text(
        text + "}\npusher: {fingers: 1}\nstart: [0, -0.2, 0]\ngoal: [0, 0, 0]\n", encoding="utf-8"
    )
    surface, figure = tmp_path / "surface.json", tmp_path / "surface.svg"
    # The pairs are about the centre of the load.
    cof = Support.points(FEET, [5, 2, 3]).centre
    moved = Support.points(FEET - cof, [5, 2, 3])
    V = twists(30)
    write(path, table(Pairs(moved.wrench(V, 0.3, 10), V)))
    status, out, err = called(
        "identify", str(path), "-o", str(surface), "--figure", str(figure), "--scene", str(scene), "--seeds", "1",
        "--folds", "5",
    )  # fmt: skip
    assert status == 0, err
    assert "loads 0.500, 0.200, 0.300 of the whole; friction × load 3.00 N" in out
    assert figure.stat().st_size < 300_000
    load_surface(surface)
    scene.write_text(
        text
        + ", surface: {file: surface.json}}\npusher: {fingers: 1}\nstart: [0, -0.2, 0]\ngoal: [0, 0, 0]\n"
    )
    status, out, err = called("describe", str(scene), "--json")
    assert status == 0
    assert json.loads(out)["pushes"]


@pytest.mark.slow
def test_a_scene_is_written_with_what_predicts_best(tmp_path) -> None:
    """Loads as the support in the scene's own units; their mean with the quartic as a quartic that is near it."""
    moved = Support.points(FEET - Support.points(FEET, [5, 2, 3]).centre, [5, 2, 3])
    V = twists(30)
    path = write(tmp_path / "pairs.csv", table(Pairs(moved.wrench(V, 0.3, 10), V)))
    scene, target = tmp_path / "scene.yaml", tmp_path / "fitted.yaml"
    feet = [[*(1000 * foot), w] for foot, w in zip(FEET, [5.0, 2.0, 3.0], strict=True)]
    feet = [[float(x) for x in foot] for foot in feet]
    scene.write_text(
        "flatpush: scene/1\nunits: {length: mm}\n"
        "object: {outline: [[-50, -50], [50, -50], [50, 50], [-50, 50]], friction: 0.3,"
        f" support: {{points: {feet}}}}}\nstart: [0, -200, 0]\ngoal: [0, 0, 0]\n"
    )
    call = ("identify", str(path), "--scene", str(scene), "-o", str(target), "--seeds", "1")
    status, out, err = called(*call)
    assert status == 0, err
    assert "chosen: loads" in out
    points, shares = load_scene(target).object.support.feet
    order = np.argsort(points[:, 0])
    assert points[order] == pytest.approx(FEET[np.argsort(FEET[:, 0])], abs=1e-9)
    assert shares[order] == pytest.approx(np.array([0.5, 0.2, 0.3])[np.argsort(FEET[:, 0])], abs=1e-3)
    status, out, err = called(*call, "--model", "mean")
    assert status == 0, err
    assert "written as a quartic that is" in out
    surface = load_scene(target).object.surface
    angles = twist_angles(surface.twist(moved.wrench(V)), V, 0.03)
    assert np.rad2deg(np.mean(angles)) < 8
    for extra, words in (("surface.json", "is written as a scene"), ("other.yaml", "--scene SCENE")):
        short = [
            "identify",
            str(path),
            "-o",
            str(tmp_path / extra),
            *(["--model", "loads"] if "json" in extra else []),
        ]
        status, _, err = called(*short)
        assert status == 2
        assert words in err


def test_identify_says_what_it_left_out_and_what_is_suspicious(tmp_path) -> None:
    data = pairs(30)
    backwards = Pairs(np.concatenate([-data.wrenches[:1], data.wrenches[1:]]), data.twists)
    path = tmp_path / "pushes.csv"
    path.write_text("\n".join([HEADER, *table(backwards), "1,2,3"]), encoding="utf-8")
    status, _, err = called("identify", str(path))
    assert status == 2
    assert "line 32: it has 3 of 6 columns" in err
    status, out, err = called(
        "identify",
        str(path),
        "--skip-bad",
        "--folds",
        "2",
        "--seeds",
        "1",
        "--json",
    )
    assert status == 2  # 30 pairs are too few for a quartic whose weights are chosen with two folds
    assert "at least 60 pairs, got 30" in err
    status, out, err = called(
        "identify",
        str(path),
        "--skip-bad",
        "--folds",
        "4",
        "--seeds",
        "1",
        "--json",
    )
    assert status == 0
    result = json.loads(out)
    assert any("line 32 left out" in note for note in result["left_out"])
    assert any("no line break ends line 32" in note for note in result["left_out"])
    assert any("1 of 30 wrenches oppose" in note for note in result["left_out"])
    assert result["experiments"][0]["pairs"] == 30


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--model", "sextic"], "--model is one of auto, ellipsoid, quartic"),
        (["--seeds", "0"], "--seeds is at least 1"),
        (["--folds", "1"], "--folds is at least 2"),
        (["--units", "mm"], "such as mm,deg"),
        (["--units", "inch,deg"], "units are m, cm or mm"),
        (["--length", "-1"], "--length is positive"),
        (["--figure", "x.gif"], ".svg or .png"),
    ],
)
def test_identify_refuses(tmp_path, monkeypatch, options, message) -> None:
    path = write(tmp_path / "pushes.csv", table(pairs(8)))
    monkeypatch.chdir(tmp_path)
    status, _, err = called("identify", str(path), *options)
    assert status == 2
    assert message in err


def test_a_surface_belongs_to_one_experiment(tmp_path) -> None:
    paths = [str(write(tmp_path / f"{name}.csv", table(pairs(24, seed=k)))) for k, name in enumerate("ab")]
    out = str(tmp_path / "s.json")
    status, _, err = called("identify", *paths, "-o", out)
    assert status == 2
    assert "--pool" in err


@pytest.mark.slow
def test_the_recorded_force_pushes(data_folder) -> None:
    """Seven experiments, five folds, two seeds, weights chosen inside each training part."""
    from flatpush.experiments.force_pushes import judgements, recorded

    judged = [judgements(experiment) for experiment in recorded(data_folder)]

    def over(model: str, what: str) -> float:
        return float(np.degrees(np.mean([getattr(row[model], what) for row in judged if model in row])))

    assert over("ellipsoid", "mean") <= 14.5
    assert over("quartic", "mean") <= 11.7
    assert over("mean", "mean") <= 11.0
    assert over("mean", "median") <= 7.5
    assert over("loads", "mean") <= 11.0
    assert over("untrained", "mean") <= 12.5
    assert sum(row["quartic"].mean < row["ellipsoid"].mean for row in judged) >= 6


def test_noise_free_ellipsoids_are_predicted(tmp_path) -> None:
    V = twists(30)
    surface = Ellipsoid(np.diag([1.0, 1.3, 1200.0]))
    judged = judge(
        Pairs(surface.wrench(V), V), Smooth("ellipsoid", ((1e-6, 0.2),)), length=LENGTH, seeds=(0,)
    )
    assert judged.mean < 1e-3
