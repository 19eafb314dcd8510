"""Which colour means what, in every figure: after the paper, and told apart by colour-blind eyes.

The colours of the pushes follow Okabe and Ito (2008), darkened where a thin line needs it;
none of them is the black of the start, the blue of the goal, or the red of obstacles and simulated runs.
"""

START = "#111111"
GOAL = "#0061b5"
SIMULATED = "#d62728"
OBSTACLE = "#c1272d"
BOUNDS = "#3b6fb6"
PUSHER = "#4d4d4d"
FORCE = "#1f5fd0"  # friction cone, as in [Zhou2017] Fig. 1
MOTION = "#d1262b"  # motion cone, as in [Zhou2017] Fig. 1
COUNTER_CLOCKWISE = "#1f5fd0"  # ray of rotation centres, as in [Zhou2017] Fig. 2
CLOCKWISE = "#c2189b"
FLAT = "#e3000f"

PUSHES = ("#009e73", "#e08a00", "#a3419b", "#3ba3dc", "#8c510a", "#85862b")


def push_colour(number: int) -> str:
    """The colour of the push with this number, from 0; they come round again after six."""
    return PUSHES[number % len(PUSHES)]
