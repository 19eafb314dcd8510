"""Cases that stand in YAML, read as quickly as the parser of this machine can."""

from pathlib import Path
from typing import Any

import yaml


def listed(path: Path) -> list[Any]:
    return yaml.load(path.read_text(encoding="utf-8"), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
