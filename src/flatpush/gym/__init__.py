"""Planning as a policy for environments that learners use."""

from .push_t import PushTPolicy

__all__ = ["PushTPolicy"]
