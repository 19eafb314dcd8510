"""Colours and words of the figures, for the page."""

from ..view import palette, words

COLOURS = 48  # pushes of one plan whose colours the page is told


def vocabulary() -> dict[str, object]:
    """Colours and words of the figures, for the page."""
    return {
        "pushes": [palette.push_colour(k) for k in range(COLOURS)],
        "start": words.START,
        "goal": words.GOAL,
        "flat": words.FLAT_PATH,
        "fingers": words.FINGERS,
        "alone": words.ALONE,
        "centre": words.CENTRE,
    }
