"""Pushing for learners: Push-T by planning, and an environment of our own, flatpush/Push-v0."""

from .policy import PushPolicy
from .push_t import PushTPolicy
from .task import Eyes, PushTask

__all__ = ["Eyes", "PushPolicy", "PushTPolicy", "PushTask", "register"]


def register() -> None:
    """Makes flatpush/Push-v0 known to Gymnasium, for gymnasium.make and gymnasium.make_vec.

    Raises:
        MissingExtra: if Gymnasium is not installed.
    """
    from ..errors import MissingExtra

    try:
        import gymnasium
    except ImportError:
        raise MissingExtra('flatpush/Push-v0 needs Gymnasium: pip install "flatpush[gym]"') from None
    if "flatpush/Push-v0" not in gymnasium.registry:
        gymnasium.register(
            "flatpush/Push-v0",
            entry_point="flatpush.gym.push:PushEnv",
            vector_entry_point="flatpush.gym.push:PushVectorEnv",
        )
