"""Many pushes as a graph: pose samples, the tree of cheapest ways to a goal, and queries from any start."""

from .query import Candidate, leg_cost, query
from .samples import pose_samples
from .store import stored_tree
from .tree import Tree, build_tree, tree_key

__all__ = ["Candidate", "Tree", "build_tree", "leg_cost", "pose_samples", "query", "stored_tree", "tree_key"]
