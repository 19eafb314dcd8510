"""A tag that an object wears: which one, how large, and where."""

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array

# Tags of the family tag36h11.
TAGS = 587
# A tag is nowhere farther from the origin of its object than this [m]; its angle may be as many radians.
FAR = 100.0


@dataclass(frozen=True, eq=False)
class Tag:
    """A tag on an object.

    Attributes:
        number: of the family tag36h11. size: side of its black border [m]. height: above the table [m].
        pose: X_OT of its middle in the object's frame, x right and y up as it is printed, (3,) [m, m, rad].

    Raises:
        InputError: with the key, for a number outside of the family, a size that is not positive, or a negative height.
    """

    number: int
    size: float
    height: float = 0.0
    pose: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        pose = np.array(self.pose, dtype=float)
        pose.setflags(write=False)
        object.__setattr__(self, "pose", pose)
        if not 0 <= self.number < TAGS:
            raise InputError(
                f"a tag of the family tag36h11 has a number from 0 to {TAGS - 1}",
                key="tag.number",
                value=self.number,
            )
        if not (np.isfinite(self.size) and self.size > 0):
            raise InputError("the size of a tag is positive", key="tag.size", value=self.size)
        if not (np.isfinite(self.height) and self.height >= 0):
            raise InputError(
                "the height of a tag over the table is 0 or more", key="tag.height", value=self.height
            )
        if pose.shape != (3,) or not np.all(np.abs(pose) <= FAR):
            raise InputError(
                "the pose of a tag is x, y (at most 100 m) and an angle", key="tag.pose", value=pose
            )
