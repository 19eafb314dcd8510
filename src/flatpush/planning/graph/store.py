"""Trees that were built before, from a file or the cache."""

import os

from ...documents.tree_file import cached_arrays, load_arrays, save_arrays
from ...errors import InputError
from ...geometry.pose import Array
from ...steering.fleet import Fleet
from .tree import Tree, build_tree, tree_key


def stored_tree(
    fleet: Fleet,
    poses: Array,
    goal: Array,
    file: str | os.PathLike[str] | None = None,
    cache: bool = True,
) -> Tree:
    """The tree of a fleet, poses and a goal, built only if it is not stored.

    Args:
        file: read if it exists, written otherwise; without one the user's cache is used.
        cache: whether it may be.

    Raises:
        InputError: if the file holds another tree or none, or cannot be written.
    """
    key = tree_key(fleet, poses, goal)
    if file is None and not cache:
        return build_tree(fleet, poses, goal)
    if file is None:
        built: list[Tree] = []

        def build() -> dict:
            built.append(build_tree(fleet, poses, goal))
            return built[0].arrays

        arrays = cached_arrays(key, build)
        if built:
            return built[0]
        try:
            return Tree.from_arrays(fleet, poses, goal, arrays)
        except InputError:  # not what it says it is
            return build_tree(fleet, poses, goal)
    if os.path.exists(file):
        arrays = load_arrays(file, key)
        try:
            return Tree.from_arrays(fleet, poses, goal, arrays)
        except InputError as error:
            raise InputError(f"this file is damaged: {error.rule}", source=os.fspath(file)) from error
    tree = build_tree(fleet, poses, goal)
    save_arrays(tree.arrays, file, key)
    return tree
