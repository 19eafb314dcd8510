"""How figures put a plan into words: its title, its cost, its legend."""

from ..problem import Plan, PushSegment


def plan_title(plan: Plan) -> str:
    """Object, number of pushes and their words."""
    name = plan.scene.object.name
    if plan.status != "solved":
        return f"{name}: no plan"
    pushes = plan.pushes
    if not pushes:
        return f"{name}: nothing to push"
    words = ", ".join(push.word or "–" for push in pushes)
    return f"{name}: one push, {words}" if len(pushes) == 1 else f"{name}: {len(pushes)} pushes, {words}"


def plan_subtitle(plan: Plan) -> str:
    """Cost and duration; without a plan the reason."""
    if plan.status != "solved":
        return plan.reason or "no reason was recorded"
    return f"cost {cost_text(plan)}, duration {plan.duration:.1f} s"


def cost_text(plan: Plan) -> str:
    """The cost with the unit that belongs to it."""
    of = {"flat": "path of the flat point", "pusher": "path of the pusher", "time": "time"}[
        plan.scene.planning.cost
    ]
    number = f"{plan.cost:.1f} s" if plan.scene.planning.cost == "time" else f"{1e3 * plan.cost:.1f} mm"
    return f"{number} ({of})"


def push_label(number: int, push: PushSegment, several: bool) -> str:
    """A push in the legend."""
    name = push.push if len(push.push) <= 32 else push.push[:31] + "…"
    text = f"push “{name}”, {push.word}"
    return f"{number + 1}: {text}" if several else text
