"""Which colour means what, in every figure and page: after the paper, and told apart by colour-blind eyes.

The first colours of the pushes follow Okabe and Ito (2008), darkened where a thin line needs it;
none of them is the black of the start, the blue of the goal, or the red of obstacles and simulated runs.
"""

START = "#111111"
GOAL = "#0061b5"
SIMULATED = "#d62728"
OBSTACLE = "#c1272d"
BOUNDS = "#3b6fb6"
PUSHER = "#4d4d4d"
TUBE = "#3a86c8"
TREE = "#8a93a0"
FORCE = "#1f5fd0"  # friction cone, as in [Zhou2017] Fig. 1
MOTION = "#d1262b"  # motion cone, as in [Zhou2017] Fig. 1
DRIVE = "#e07b00"  # the pushing direction u of [Zhou2017] Fig. 1 and its rotation centre
COUNTER_CLOCKWISE = "#1f5fd0"  # ray of rotation centres, as in [Zhou2017] Fig. 2
CLOCKWISE = "#c2189b"
STRAIGHT = "#11804f"
FLAT = "#e3000f"

PUSHES = (
    "#009e73", "#e08a00", "#a3419b", "#3ba3dc", "#8c510a", "#85862b",
    "#5e4fa2", "#d86aa6", "#4f8f1f", "#7b8794", "#14606e", "#b39400",
)  # fmt: skip


def push_colour(number: int) -> str:
    """The colour of the push with this number, from 0; no two pushes of a plan share one."""
    if number < len(PUSHES):
        return PUSHES[number]
    import colorsys

    # Hues a golden section apart never meet again; the lightness keeps neighbours apart as well.
    k = number - len(PUSHES)
    rgb = colorsys.hls_to_rgb((0.13 + 0.6180339887 * k) % 1.0, 0.34 + 0.07 * (k % 3), 0.55)
    return "#" + "".join(f"{round(255 * value):02x}" for value in rgb)
