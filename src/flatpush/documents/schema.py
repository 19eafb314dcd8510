"""The JSON Schemas of the documents, generated from the models that read them."""

import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "schemas"


def scene_schema() -> dict[str, object]:
    """The JSON Schema (draft 2020-12) of a scene document. It describes the structure; some rules are beyond
    it."""
    from .scene_model import SceneModel

    return _schema(SceneModel, "flatpush scene")


def plan_schema() -> dict[str, object]:
    """The JSON Schema (draft 2020-12) of a plan document."""
    from .plan_model import PlanModel

    return _schema(PlanModel, "flatpush plan")


def write_schemas() -> None:
    """Writes both schemas to the folder that is shipped with the package; a test checks that they are
    current."""
    from .atomic import write_atomically

    for name, schema in (("scene", scene_schema()), ("plan", plan_schema())):
        text = json.dumps(schema, indent=1, ensure_ascii=False, sort_keys=True) + "\n"
        write_atomically(FOLDER / f"{name}.schema.json", text)


def _schema(model: Any, title: str) -> dict[str, Any]:
    schema: dict[str, Any] = model.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": title}
