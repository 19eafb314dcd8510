"""How figures and pages put a plan into words: its title, its cost, its pushes, what goes on."""

from ..problem import Plan, PushSegment, Scene, TableSegment

START, GOAL, BOTH = "start", "goal", "start = goal"
FLAT_PATH = "path of the flat point"
WAY = "path of the centre of friction so far"
FINGERS, FINGERS_ALONE = "fingers and their path", "fingers"
ALONE = "pusher alone (dotted: lifted)"
CENTRE = "turning centre (+ left, − right)"
TUBE = "from any start: its centre of friction"
FRICTION_CONE, MOTION_CONE = "friction cone", "motion cone in use"
CONTACT, CONTROLLER = "contact", "controller"
STICKS, SLIDES_LEFT, SLIDES_RIGHT = "sticks", "slides to the left", "slides to the right"
OFF, RESTS = "off the object", "at rest"
SLIDES, SLIDE_PATH = "slides", "slides: path of the centre of friction"
STRIP = "Fingers on the object, in order"
BOUNDS, OBSTACLE, TREE, SIMULATED = "bounds", "obstacle", "search tree", "simulated"


def plan_title(plan: Plan) -> str:
    """What happens: the object, how many pushes, and how long that takes; how far it goes is the cost's to say."""
    name = plan.scene.object.name
    if plan.status != "solved":
        return f"{name}: no plan"
    pushes = plan.on_table
    if not pushes:
        return f"{name}: nothing to push"
    count = "one push" if len(pushes) == 1 else f"{len(pushes)} pushes"
    return f"{name}: {count}, {plan.duration:.0f} s"


def plan_subtitle(plan: Plan) -> str:
    """The cost and where it comes from; without a plan the reason."""
    if plan.status != "solved":
        return plan.reason or "no reason was recorded"
    changes = max(len(plan.on_table) - 1, 0)
    switching = plan.scene.planning.switching
    text = f"cost {cost_text(plan)}"
    if changes and switching > 0:
        each = f"{switching:g} s" if plan.scene.planning.cost == "time" else f"{1e3 * switching:g} mm"
        text += f", with {changes} change{'s' * (changes > 1)} of contact at {each}"
    return text


def cost_text(plan: Plan) -> str:
    """The cost with the unit that belongs to it."""
    return cost_words(plan.scene, plan.cost)


def cost_words(scene: Scene, cost: float) -> str:
    """A cost of a path in a scene with the unit that belongs to it."""
    of = {"flat": FLAT_PATH, "pusher": "path of the pusher", "time": "time"}[scene.planning.cost]
    number = f"{cost:.1f} s" if scene.planning.cost == "time" else f"{1e3 * cost:.1f} mm"
    return f"{number} ({of})"


def word_of(push: TableSegment) -> str:
    """The word of a push, or what a slide is."""
    return push.word if isinstance(push, PushSegment) else SLIDES


def push_label(number: int, push: TableSegment, several: bool) -> str:
    """A push in a legend."""
    name = push.push if len(push.push) <= 32 else push.push[:31] + "…"
    text = f"push “{name}”, {word_of(push)}"
    return f"{number + 1}: {text}" if several else text
