"""Writes a run as one MCAP file of standard ROS 2 messages, which ros2 bag, rosbags and Foxglove read."""

import math
import os
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import ModuleType, TracebackType
from typing import TYPE_CHECKING, Self

from ..errors import MissingExtra
from ..geometry.pose import Array

if TYPE_CHECKING:
    from .run import Cycle

# Topic → type of its messages.
TOPICS = {
    "/flatpush/target": "geometry_msgs/msg/PoseStamped",
    "/flatpush/tool": "geometry_msgs/msg/PoseStamped",
    "/flatpush/twist": "geometry_msgs/msg/TwistStamped",
    "/flatpush/object": "geometry_msgs/msg/PoseStamped",
    "/flatpush/state": "std_msgs/msg/String",
}
FRAME = "table"
# The end of an MCAP file without a summary: records DataEnd (15) and Footer (2), and the magic bytes.
END = struct.pack("<BQI", 15, 4, 0) + struct.pack("<BQQQI", 2, 20, 0, 0, 0) + b"\x89MCAP0\r\n"


def load() -> tuple[ModuleType, ModuleType]:
    """The libraries.

    Raises:
        MissingExtra: if they are not installed.
    """
    try:
        import mcap.writer
        import rosbags.typesys
    except ImportError:
        raise MissingExtra(
            'a log ending in .mcap needs mcap and rosbags: pip install "flatpush[export]"'
        ) from None
    return mcap.writer, rosbags.typesys


class WholeFile:
    """Bytes that always end as an MCAP file does: what is committed later is written over that end.

    So a program that is killed leaves a file that readers take, up to the last commit.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = Path(path).open("wb", buffering=0)  # noqa: SIM115  # closed by close
        self._waiting, self._at = bytearray(), 0

    def write(self, data: bytes) -> int:
        self._waiting += data
        return len(data)

    def tell(self) -> int:
        return self._at + len(self._waiting)

    def flush(self) -> None:
        """Nothing is written before it is committed."""

    def commit(self, end: bytes = END) -> None:
        try:
            self._put(bytes(self._waiting) + end)
        except OSError:  # of a full disk; the last commit stands, in the room that it has
            with suppress(OSError):
                self._put(END if self._at else b"")
                self._file.truncate(self._file.tell())
            raise
        self._at += len(self._waiting)
        self._waiting.clear()

    def _put(self, data: bytes) -> None:
        self._file.seek(self._at)
        while data:
            data = data[self._file.write(data) :]

    def close(self) -> None:
        with self._file:
            self.commit(b"")
            self._file.truncate(self._at)

    def abandon(self) -> None:
        """Closes it as it is."""
        self._file.close()


class McapLog:
    """Every cycle: target, tool and twist (of the target), the object where it is known, and text where it changes."""

    def __init__(self, path: str | os.PathLike[str], name: str) -> None:
        writer, typesys = load()
        store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        self._types, self._encode = store.types, store.serialize_cdr
        self._file = WholeFile(path)
        self._writer = writer.Writer(self._file, use_chunking=False)
        self._writer.start(profile="ros2", library="flatpush")
        self._writer.add_metadata("flatpush", {"object": name})
        schemas = {
            kind: self._writer.register_schema(
                kind, "ros2msg", store.generate_msgdef(kind, ros_version=2)[0].encode()
            )
            for kind in dict.fromkeys(TOPICS.values())
        }
        self._channels = {
            topic: self._writer.register_channel(topic, "cdr", schemas[kind])
            for topic, kind in TOPICS.items()
        }
        self._said, self._time = "", 0
        try:
            self._file.commit()
        except OSError:
            self._file.abandon()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.finish()
        self._file.close()

    def write(self, cycle: "Cycle") -> None:
        self._time = round(1e9 * cycle.time)
        self._put("/flatpush/target", self._pose(cycle.target.pose))
        self._put("/flatpush/tool", self._pose(cycle.state.pose))
        self._put("/flatpush/twist", self._twist(cycle.target.twist))
        if cycle.object is not None:
            x, y, turn = cycle.object
            self._put("/flatpush/object", self._pose([x, y, 0.0, turn]))
        said = f"{cycle.leg}: {cycle.mode}"
        if said != self._said:
            self._said = said
            self._say(said)
        self._file.commit()

    def end(self, outcome: str) -> None:
        self._say(outcome)
        self._file.commit()

    def _say(self, text: str) -> None:
        self._put("/flatpush/state", self._of("std_msgs/msg/String")(text))

    def _of(self, kind: str) -> Callable[..., object]:
        made: Callable[..., object] = self._types[kind]
        return made

    def _put(self, topic: str, message: object) -> None:
        data = bytes(self._encode(message, TOPICS[topic]))
        self._writer.add_message(self._channels[topic], self._time, data, self._time)

    def _header(self) -> object:
        stamp = self._of("builtin_interfaces/msg/Time")(self._time // 10**9, self._time % 10**9)
        return self._of("std_msgs/msg/Header")(stamp, FRAME)

    def _vector(self, x: float, y: float, z: float, kind: str = "Vector3") -> object:
        return self._of(f"geometry_msgs/msg/{kind}")(float(x), float(y), float(z))

    def _pose(self, pose: "Array | list[float]") -> object:
        x, y, z, yaw = pose
        turn = self._of("geometry_msgs/msg/Quaternion")(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
        placed = self._of("geometry_msgs/msg/Pose")(self._vector(x, y, z, "Point"), turn)
        return self._of("geometry_msgs/msg/PoseStamped")(self._header(), placed)

    def _twist(self, twist: Array) -> object:
        x, y, z, spin = twist
        moves = self._of("geometry_msgs/msg/Twist")(self._vector(x, y, z), self._vector(0.0, 0.0, spin))
        return self._of("geometry_msgs/msg/TwistStamped")(self._header(), moves)
