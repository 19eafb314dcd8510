"""Parses and writes files: scenes, plans, shapes, surfaces, exports. Everything inside is SI.

The modules behind these names (pydantic, yaml and the shape readers among them) are imported when first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .atomic import check_outputs, check_writable, write_atomically
    from .export import export_csv, export_rapid
    from .files_read import as_read, plan_files, scene_files
    from .fitted_scene import save_fitted_scene
    from .loading import load_plan, load_scene
    from .log_columns import columns_of_scene, own_columns
    from .motion_file import Motion, MotionFile, is_motion_file, load_motions
    from .outline_reader import OutlineNote, outline_note
    from .pairs_file import PairsFile, load_pairs
    from .plan_file import parse_plan, plan_document, save_plan
    from .reading import mapping_of, read_mapping
    from .robot_log import RobotLog, RobotRun, load_robot_log
    from .rollout_file import save_rollouts
    from .rows import BadRow
    from .runs_file import save_runs
    from .scene_reader import parse_ends, parse_scene
    from .scene_writer import scene_document
    from .schema import plan_schema, scene_schema
    from .surface_file import load_surface, save_surface
    from .template import scene_template

__all__ = [
    "BadRow",
    "Motion",
    "MotionFile",
    "OutlineNote",
    "PairsFile",
    "RobotLog",
    "RobotRun",
    "as_read",
    "check_outputs",
    "check_writable",
    "columns_of_scene",
    "export_csv",
    "export_rapid",
    "is_motion_file",
    "load_motions",
    "load_pairs",
    "load_plan",
    "load_robot_log",
    "load_scene",
    "load_surface",
    "mapping_of",
    "outline_note",
    "own_columns",
    "parse_ends",
    "parse_plan",
    "parse_scene",
    "plan_document",
    "plan_files",
    "plan_schema",
    "read_mapping",
    "save_fitted_scene",
    "save_plan",
    "save_rollouts",
    "save_runs",
    "save_surface",
    "scene_document",
    "scene_files",
    "scene_schema",
    "scene_template",
    "write_atomically",
]

_HOME = {
    "BadRow": "rows",
    "Motion": "motion_file",
    "MotionFile": "motion_file",
    "is_motion_file": "motion_file",
    "load_motions": "motion_file",
    "columns_of_scene": "log_columns",
    "own_columns": "log_columns",
    "save_fitted_scene": "fitted_scene",
    "OutlineNote": "outline_reader",
    "PairsFile": "pairs_file",
    "RobotLog": "robot_log",
    "RobotRun": "robot_log",
    "check_outputs": "atomic",
    "check_writable": "atomic",
    "export_csv": "export",
    "export_rapid": "export",
    "load_pairs": "pairs_file",
    "load_plan": "loading",
    "load_robot_log": "robot_log",
    "load_scene": "loading",
    "load_surface": "surface_file",
    "mapping_of": "reading",
    "outline_note": "outline_reader",
    "parse_plan": "plan_file",
    "parse_ends": "scene_reader",
    "parse_scene": "scene_reader",
    "plan_document": "plan_file",
    "plan_schema": "schema",
    "read_mapping": "reading",
    "save_plan": "plan_file",
    "save_rollouts": "rollout_file",
    "save_runs": "runs_file",
    "save_surface": "surface_file",
    "scene_document": "scene_writer",
    "as_read": "files_read",
    "plan_files": "files_read",
    "scene_files": "files_read",
    "scene_schema": "schema",
    "scene_template": "template",
    "write_atomically": "atomic",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)
