"""Compiled: which of many ways of a fingertip is clear of an object made of boxes."""

import math

import numba as nb
import numpy as np

from ..compiled import inner, kernel

REALS, POINT, POINTS = nb.float64[:, ::1], nb.float64[::1], nb.float64[:, :, ::1]


@inner
def box_gap(x, y, box):  # type: ignore[no-untyped-def]
    """Distance of a point from a box (lower left corner, upper right corner); 0 inside."""
    return math.hypot(max(box[0, 0] - x, 0.0, x - box[1, 0]), max(box[0, 1] - y, 0.0, y - box[1, 1]))


@inner
def way_length(places_of, known, target, pose, boxes, clearance, most):  # type: ignore[no-untyped-def]
    """Length of a way; infinite if it comes too close to a box or is not shorter than the most."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    length, x, y = 0.0, 0.0, 0.0
    for k in range(places_of.shape[0]):
        before_x, before_y = x, y
        x, y = target[0] - pose[0], target[1] - pose[1]
        for j in range(places_of.shape[1]):
            x += places_of[k, j] * known[j, 0]
            y += places_of[k, j] * known[j, 1]
        for b in range(boxes.shape[0]):
            if box_gap(c * x + s * y, c * y - s * x, boxes[b]) < clearance:
                return math.inf
        if k:
            length += math.hypot(x - before_x, y - before_y)
        if length >= most:
            return math.inf
    return length


@kernel(nb.int64(REALS, REALS, POINT, POINT, POINTS, nb.float64, POINT, POINTS, nb.float64))
def shortest_clear(last_of, places_of, place, target, begun, room, pose, boxes, clearance):  # type: ignore[no-untyped-def]
    """The shortest of n ways from rest at a place to rest at a target that is clear of an object; -1 if none is.

    Args:
        last_of, places_of: of the agent's law, for ways with so many first commands.
        begun: first commands of each way, shape (n, m, 2). room: that of the commands.
        pose, boxes: of the object and its parts in its frame, (b, 2, 2). clearance: from them.
    """
    shortest, found = math.inf, -1
    known = np.empty((begun.shape[1] + 1, 2))
    for i in range(begun.shape[0]):
        for d in range(2):
            known[0, d] = place[d] - target[d]
            for j in range(begun.shape[1]):
                known[1 + j, d] = begun[i, j, d] - target[d]
        allowed = True
        for r in range(2):
            for d in range(2):
                command = target[d]
                for j in range(known.shape[0]):
                    command += last_of[r, j] * known[j, d]
                allowed = allowed and 0.0 <= command <= room
        if allowed:
            length = way_length(places_of, known, target, pose, boxes, clearance, shortest)
            if length < shortest:
                shortest, found = length, i
    return found
