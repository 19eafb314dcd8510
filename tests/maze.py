"""Mazes, one of our own and those of the recorded data, and a check of ways by dense samples."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

import flatpush as fp
from flatpush.geometry import Outline, compose, exp, transform
from flatpush.geometry.collision import Body, World
from flatpush.planning.obstacles import query_of
from flatpush.planning.query import Query
from flatpush.steering.fleet import Fleet

MAZE_A = "maze2_verytight_mu05steerdist05k100_robotexecute"
MAZE_B = "maze2_verytight_mu045steerdist055k100_robotexecute"


EXAMPLE = Path(__file__).parents[1] / "examples" / "maze.yaml"


def maze_scene(**planning) -> fp.Scene:
    """The maze of the examples without a clearance; pushes are chosen automatically, and iterations end the search."""
    scene = fp.load_scene(EXAMPLE)
    asked = replace(scene.planning, clearance=0.0, time_limit=1e6, iterations=400, **planning)
    return replace(scene, pushes="auto", planning=asked)


def maze_query(need=0.0) -> Query:
    """The search of that maze."""
    planner = fp.Planner(maze_scene())
    return replace(query_of(planner.scene, planner.usable, planner.fleet), clearance=need)


def stored_query(folder, name=MAZE_B, need=0.0, approach=0.002) -> Query:
    """A stored maze: contacts at the middle of the tip centres, cars and switching cost as in its file."""
    document = json.loads((folder / "maze" / f"{name}.json").read_text())
    outline = Outline.polygon(document["object_vertices_xy"])
    tip, half = document["tip_radius"], 0.5 * document["finger_width"]
    left, right, ahead, bodies, backs = [], [], [], [], []
    for push in document["push_actions"]:
        frame, radius = np.array(push["push_frame_in_body"]), push["turning_radius"]
        # The file rounds to nine digits; words need directions of length one.
        frame[:2, :2] /= np.hypot(*frame[:2, :2])
        ahead.append(frame[:2, 1])
        left.append(frame[:2, 2] - radius * frame[:2, 0])
        right.append(frame[:2, 2] + radius * frame[:2, 0])
        at, normal = np.array(push["contact_point"]), np.array(push["inward_normal"])
        across = half * np.array([-normal[1], normal[0]])
        bodies.append(Body.of(outline, [at + across, at - across], tip))
        backs.append(-approach * normal)
    radii, k = np.array([push["turning_radius"] for push in document["push_actions"]]), len(left)
    free = np.full((k, 3), np.inf)
    switching = document["cost_switch"] * (1 - np.eye(k))
    fleet = Fleet(
        np.array(left),
        np.array(right),
        np.array(ahead),
        np.stack([radii, np.ones(k), radii], 1),
        free,
        free,
        switching,
    )
    xmin, xmax, ymin, ymax = document["boundary_xmin_xmax_ymin_ymax"]
    world = World.of([xmin, ymin, xmax, ymax], [np.array(o) for o in document["obstacles_xy"]])
    start, goal = np.array(document["pose_start"]), np.array(document["pose_goal"])
    return Query(fleet, start, goal, world, bodies, np.array(backs), need)


def dense_clearance(world: World, body: Body, start, steps, spacing=1e-4) -> float:
    """Least clearance at poses between which no point of the body moves further than `spacing`, by shapely [m].

    An overlap counts as minus its depth where it is less than a millimetre deep, else as minus infinity.
    """
    reach = body.outline.radius_about((0.0, 0.0)) + np.max(np.hypot(*body.discs.T), initial=0.0)
    poses, X = [np.asarray(start, dtype=float)[None]], np.asarray(start, dtype=float)
    for step in np.asarray(steps, dtype=float).reshape(-1, 3):
        n = max(1, int(np.ceil((np.hypot(*step[:2]) + abs(step[2]) * reach) / spacing)))
        poses.append(compose(X, exp(np.linspace(0, 1, n + 1)[1:, None] * step)))
        X = compose(X, exp(step))
    every = np.concatenate(poses)
    points = [transform(every, tip) for tip in body.discs]
    corners = np.stack([transform(every, corner) for corner in body.outline.polyline()], axis=1)
    low, high = world.bounds[:2], world.bounds[2:]
    best = min(np.min(corners - low), np.min(high - corners))
    for tips in points:
        best = min(best, np.min(tips - low) - body.radius, np.min(high - tips) - body.radius)
    shapes = shapely.polygons(corners)
    for obstacle in world.obstacles:
        solid = shapely.Polygon(obstacle.polyline())
        shapely.prepare(solid)
        best = min(best, np.min(shapely.distance(shapes, solid)))
        # Touching is free: only an overlap that a hair less of obstacle would still have counts.
        if np.any(shapely.intersects(shapes, solid.buffer(-2e-7))):
            best = min(best, -1e-7)
        if np.any(shapely.intersects(shapes, solid.buffer(-1e-3))):
            best = -np.inf
        for tips in points:
            best = min(best, np.min(shapely.distance(shapely.points(tips), solid)) - body.radius)
    return float(best)


def check_way(query: Query, way, need=0.0) -> None:
    """Ends at the goal, keeps the clearance by dense samples, and lands and leaves clear at every change."""
    assert np.max(np.abs(compose(way.poses[-1], [0, 0, 0])[:2] - query.goal[:2])) < 1e-8
    assert abs(np.remainder(way.poses[-1][2] - query.goal[2] + np.pi, 2 * np.pi) - np.pi) < 1e-8
    pieces, pose = [], way.start
    for i, (push, letter, amount) in enumerate(way.pieces):
        pieces.append(way.step(push, letter, amount))
        if i + 1 == len(way.pieces) or way.pieces[i + 1][0] != push:
            assert dense_clearance(query.world, query.bodies[push], pose, pieces) >= need, (push, i)
            for at in (pose, way.poses[i + 1]):
                hand = Body.of(Outline.circle(query.bodies[push].radius))
                for tip in query.bodies[push].discs:
                    a, b = transform(at, tip), transform(at, tip + query.backs[push])
                    assert dense_clearance(query.world, hand, [*a, 0.0], [[*(b - a), 0.0]]) >= need - 1e-5
            pieces, pose = [], way.poses[i + 1]
