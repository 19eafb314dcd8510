"""Demonstrations as a LeRobot v3.0 data set, by pyarrow alone; every file appears whole, the index of them last."""

import io
import json
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from ..documents import scene_document, write_atomically
from ..errors import InputError, MissingExtra
from ..geometry.pose import Array
from .demonstrations import Block, Episode
from .task import STATE
from .trajectories import Form, numbered, save_episode

VERSION = "v3.0"
CHUNK = 1000  # files in a folder
FPS = 10
TASK = "push the object to the goal"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"


def load() -> tuple[ModuleType, ModuleType]:
    """pyarrow and its Parquet part.

    Raises:
        MissingExtra: if it is not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra('data sets need pyarrow: pip install "flatpush[demonstrations]"') from None
    return pyarrow, pyarrow.parquet


class LeRobotFolder:
    """A data set that grows by blocks; what info.json counts is complete, whatever breaks off after.

    Args:
        folder: that holds it. seed: of all that is random in it.
        also: forms in which each episode is written beside it.

    Attributes:
        episodes, frames: how many are complete. blocks: how many blocks were tried for them.

    Raises:
        InputError: for a folder that holds something else, or a data set of another seed or other forms.
    """

    def __init__(self, folder: Path, seed: int, also: Sequence[Form] = ()) -> None:
        self.folder, self.seed, self.also = folder, seed, sorted(set(also))
        self.episodes = self.frames = self.blocks = self.files = 0
        self._sums: dict[str, list[Array]] = {}
        info = folder / "meta" / "info.json"
        if info.exists():
            self._go_on(info)
        elif folder.exists() and any(folder.iterdir()):
            raise InputError("this folder holds something else", source=str(folder), hint="Choose another.")
        folder.mkdir(parents=True, exist_ok=True)  # fails before the work begins, not after

    def add(self, block: Block, most: int) -> None:
        """Writes the episodes of a block, so many at most, then counts them."""
        chosen = block.episodes[:most]
        if chosen:
            place = {"chunk_index": self.files // CHUNK, "file_index": self.files % CHUNK}
            write_atomically(
                self._made(f"meta/flatpush/scene-{self.blocks:05d}.json"),
                json.dumps(scene_document(block.scene)),
            )
            self._write(DATA.format(**place), self._rows(chosen))
            self._write(EPISODES.format(**place), self._listed(chosen, place))
            for number, episode in enumerate(chosen, start=self.episodes):
                for form in self.also:
                    path = numbered(self.folder, form, number)
                    save_episode(path, form, episode, FPS, block.scene.pusher.speed)
            for episode in chosen:
                self._count(episode)
            self.files += 1
        self.blocks += 1
        self._write("meta/tasks.parquet", {"task_index": [0], "task": [TASK]}, index="task")
        write_atomically(self._made("meta/stats.json"), json.dumps(self._stats(), indent=1))
        write_atomically(self._made("meta/info.json"), json.dumps(self._info(), indent=1))

    def _go_on(self, info: Path) -> None:
        try:
            known = json.loads(info.read_text(encoding="utf-8"))
            own = known["flatpush"]
            self.episodes, self.frames = known["total_episodes"], known["total_frames"]
            self.blocks, self.files, seed, also = (
                own["blocks"],
                own["files"],
                own["seed"],
                own.get("also", []),
            )
            self._sums = {name: [np.array(row) for row in rows] for name, rows in own["sums"].items()}
            for number in (self.episodes, self.frames, self.blocks, self.files):
                if not (isinstance(number, int) and number >= 0):
                    raise ValueError(f"{number} counts nothing")
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError("this is no data set that flatpush wrote", source=str(info)) from error
        if seed != self.seed:
            raise InputError(
                "this data set has another seed",
                key="seed",
                value=seed,
                hint="Go on with the same, or choose a folder.",
            )

        if also != self.also:
            raise InputError(
                "this data set has other forms beside it",
                key="--also",
                value=self.also,
                hint=f"It was begun with {', '.join(map(str, also)) or 'none'}."
                if isinstance(also, list)
                else "",
            )

    def _rows(self, episodes: Sequence[Episode]) -> dict[str, ArrayLike]:
        lengths = [len(e.actions) for e in episodes]
        step = np.concatenate([np.arange(n) for n in lengths])
        number = np.repeat(self.episodes + np.arange(len(episodes)), lengths)
        last = np.concatenate([np.arange(n) == n - 1 for n in lengths])
        return {
            "observation.state": np.concatenate([e.states for e in episodes]).astype(np.float32),
            "action": np.concatenate([e.actions for e in episodes]).astype(np.float32),
            "next.reward": np.concatenate([e.rewards for e in episodes]).astype(np.float32),
            "next.done": last,
            "next.success": last,
            "timestamp": (step / FPS).astype(np.float32),
            "frame_index": step,
            "episode_index": number,
            "index": self.frames + np.arange(len(step)),
            "task_index": np.zeros(len(step), dtype=np.int64),
        }

    def _listed(self, episodes: Sequence[Episode], place: dict[str, int]) -> dict[str, ArrayLike]:
        lengths = np.array([len(e.actions) for e in episodes])
        ends = self.frames + np.cumsum(lengths)
        count = len(episodes)
        found: dict[str, ArrayLike] = {
            "episode_index": self.episodes + np.arange(count),
            "tasks": [[TASK]] * count,
            "length": lengths,
            "dataset_from_index": ends - lengths,
            "dataset_to_index": ends,
        }
        for kind in ("data", "meta/episodes"):
            for name, value in place.items():
                found[f"{kind}/{name}"] = np.full(count, value)
        found |= {
            "flatpush/scene": [e.scene for e in episodes],
            "flatpush/seed": [e.seed for e in episodes],
            "flatpush/disturbed": [e.disturbed for e in episodes],
            "flatpush/displacement": np.array([e.displacement for e in episodes]),
        }
        for name in _values(episodes[0]):
            each = [_values(e)[name] for e in episodes]
            for what, of in (("min", np.min), ("max", np.max), ("mean", np.mean), ("std", np.std)):
                found[f"stats/{name}/{what}"] = np.array([of(rows, axis=0) for rows in each])
            found[f"stats/{name}/count"] = lengths[:, None]
        return found

    def _count(self, episode: Episode) -> None:
        for name, rows in _values(episode).items():
            new = [rows.min(axis=0), rows.max(axis=0), rows.sum(axis=0), (rows**2).sum(axis=0)]
            old = self._sums.get(name)
            if old is not None:
                new = [
                    np.minimum(old[0], new[0]),
                    np.maximum(old[1], new[1]),
                    old[2] + new[2],
                    old[3] + new[3],
                ]
            self._sums[name] = new
        self.episodes += 1
        self.frames += len(episode.actions)

    def _stats(self) -> dict[str, dict[str, list[float]]]:
        found = {}
        for name, (low, high, total, squares) in self._sums.items():
            mean = total / self.frames
            std = np.sqrt(np.maximum(squares / self.frames - mean**2, 0.0))
            found[name] = {
                "min": low.tolist(), "max": high.tolist(), "mean": mean.tolist(), "std": std.tolist(),
                "count": [self.frames],
            }  # fmt: skip
        return found

    def _info(self) -> dict[str, object]:
        def feature(dtype: str, names: Sequence[str] | None = None) -> dict[str, object]:
            return {
                "dtype": dtype,
                "shape": [len(names) if names else 1],
                "names": list(names) if names else None,
            }

        return {
            "codebase_version": VERSION,
            "robot_type": "flatpush",
            "total_episodes": self.episodes,
            "total_frames": self.frames,
            "total_tasks": 1,
            "chunks_size": CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 500,
            "fps": FPS,
            "splits": {"train": f"0:{self.episodes}"},
            "data_path": DATA,
            "video_path": None,
            "features": {
                "observation.state": feature("float32", STATE),
                "action": feature("float32", ("velocity x", "velocity y")),
                "next.reward": feature("float32"),
                "next.done": feature("bool"),
                "next.success": feature("bool"),
                "timestamp": feature("float32"),
                **{n: feature("int64") for n in ("frame_index", "episode_index", "index", "task_index")},
            },
            "flatpush": {
                "seed": self.seed, "blocks": self.blocks, "files": self.files,
                "also": self.also,
                "sums": {name: [row.tolist() for row in rows] for name, rows in self._sums.items()},
            },
        }  # fmt: skip

    def _made(self, name: str) -> Path:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def _write(self, name: str, columns: dict[str, ArrayLike], index: str = "") -> None:
        """A table as Parquet; an index column is told to pandas."""
        arrow, parquet = load()
        arrays = {}
        for key, values in columns.items():
            array = values if isinstance(values, list) else np.asarray(values)
            if isinstance(array, np.ndarray) and array.ndim == 2:
                flat = arrow.array(array.ravel())
                arrays[key] = arrow.FixedSizeListArray.from_arrays(flat, array.shape[1])
            else:
                arrays[key] = arrow.array(array)
        table = arrow.table(arrays)
        if index:
            told = {"index_columns": [index], "column_indexes": [], "columns": [], "pandas_version": "2.0.0"}
            table = table.replace_schema_metadata({"pandas": json.dumps(told)})
        buffer = io.BytesIO()
        parquet.write_table(table, buffer)
        write_atomically(self._made(name), buffer.getvalue())


def _values(episode: Episode) -> dict[str, Array]:
    """What statistics are made of, each (n, values)."""
    count = len(episode.actions)
    last = (np.arange(count) == count - 1)[:, None].astype(float)
    return {
        "observation.state": np.asarray(episode.states, dtype=float),
        "action": np.asarray(episode.actions, dtype=float),
        "next.reward": np.asarray(episode.rewards, dtype=float)[:, None],
        "next.done": last,
        "next.success": last,
        "timestamp": np.arange(count)[:, None] / FPS,
    }
