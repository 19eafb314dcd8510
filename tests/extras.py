"""Why a test is skipped where a package is missing that not every environment has."""


def extra(name: str) -> str:
    """The reason: one of our extras is not installed."""
    return f'needs an extra: pip install "flatpush[{name}]"'
