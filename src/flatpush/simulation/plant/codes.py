"""The codes of contact modes and of outcomes, and their words."""

from ...contact import ContactMode

REST, STICKING, LEFT, RIGHT, SEPARATION = range(5)
MODES = tuple(
    mode.value
    for mode in (
        ContactMode.REST,
        ContactMode.STICKING,
        ContactMode.SLIDING_LEFT,
        ContactMode.SLIDING_RIGHT,
        ContactMode.SEPARATION,
    )
)

GOING, JAMMED, GRASPED, INSIDE, MANY, UNDECIDED = range(6)
OUTCOMES = ("", "jammed", "grasped", "starts inside", "too many contacts", "undecided")

STRAIGHT, BODY, AS_IT_IS = range(3)
"""How a hand goes from pose to pose: straight, the shorter way round; with a constant body twist; straight, with the
turn that is the difference of the two angles."""
