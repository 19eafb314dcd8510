"""A fingertip that follows a commanded place with a proportional-derivative law: what it will do, and how to stop it.

In each of a control step's substeps its velocity is changed by dt (kp (command - place) - kv velocity), then its place
by dt · velocity. That is linear and alike in both coordinates, so whole ways are products with matrices, and the last
two commands of a way can always be such that it ends at rest where it should.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.pose import Array

LONGEST = 12  # control steps of a straight way


@dataclass(frozen=True)
class Agent:
    """The law of a fingertip.

    Attributes:
        stiffness, damping: kp [1/s²] and kv [1/s].
        dt: of a substep [s].
        substeps: in a control step.
        room: commands are places with both coordinates from 0 to this [m].
    """

    stiffness: float
    damping: float
    dt: float
    substeps: int
    room: float

    def way(self, place: Array, target: Array, begun: Array) -> Array:
        """Commands (m + 2, 2) from rest at a place (2,) to rest at a target (2,), the first m of them given (m, 2)."""
        last_of, _ = self.laws(len(begun))
        return np.concatenate([begun, last_of @ (np.concatenate([place[None], begun]) - target) + target])

    def laws(self, first: int) -> tuple[Array, Array]:
        """For 0, 1 or 2 first commands of a way from rest to rest: its last two commands, and its places.

        Both are matrices of what is known of the way, seen from its target: the place where it begins and the first
        commands. Shapes (2, first + 1) and ((first + 2) · substeps, first + 1): a place for each substep.
        """
        return self._laws[first]

    def straight(self, place: Array, target: Array) -> Array | None:
        """The fewest commands (m, 2) that lead straight from rest to rest; None if 12 are too few."""
        for shares in self._shares:
            commands = place + shares[:, None] * (target - place)
            if self.allowed(commands):
                return commands
        return None

    def allowed(self, commands: Array) -> Array:
        """Whether all of the commands (..., m, 2) are in the room, shape (...)."""
        return np.all((commands >= 0.0) & (commands <= self.room), axis=(-2, -1))

    def response(self, count: int) -> tuple[Array, Array]:
        """(Place, velocity) after each substep of count commands, as matrices of the state and of the commands.

        Shapes (count · substeps, 2, 2) and (count · substeps, 2, count).
        """
        faster = np.array([-self.stiffness * self.dt, 1 - self.damping * self.dt])
        matrix = np.stack([[1.0, 0.0] + self.dt * faster, faster])
        column = np.array([self.dt, 1.0]) * self.stiffness * self.dt
        of_state, of_commands = [np.eye(2)], [np.zeros((2, count))]
        for k in range(count):
            for _ in range(self.substeps):
                of_state.append(matrix @ of_state[-1])
                of_commands.append(matrix @ of_commands[-1])
                of_commands[-1][:, k] += column
        return np.array(of_state[1:]), np.array(of_commands[1:])

    @cached_property
    def _laws(self) -> tuple[tuple[Array, Array], ...]:
        made = []
        for first in range(3):
            of_state, of_commands = self.response(first + 2)
            known = np.column_stack([of_state[-1][:, 0], of_commands[-1][:, :first]])
            last = -np.linalg.solve(of_commands[-1][:, first:], known)
            commands = np.vstack([np.eye(first + 1)[1:], last])
            places = np.outer(of_state[:, 0, 0], np.eye(first + 1)[0]) + of_commands[:, 0] @ commands
            made.append((np.ascontiguousarray(last), np.ascontiguousarray(places)))
        return tuple(made)

    @cached_property
    def _shares(self) -> list[Array]:
        """For 2 to 12 commands from rest to rest, places as shares of the way: of all that do it the nearest to 1."""
        ends = [self.response(count)[1][-1] for count in range(2, LONGEST + 1)]
        left = [np.array([1.0, 0.0]) - end.sum(axis=1) for end in ends]
        return [1.0 + np.linalg.lstsq(end, rest, rcond=None)[0] for end, rest in zip(ends, left, strict=True)]
