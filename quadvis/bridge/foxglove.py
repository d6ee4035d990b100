"""A server for Foxglove: signals as channels, poses, pictures and parameters, by Foxglove's own SDK.

Its channels are those of a log: a topic for each block, ROS 2 messages, the same fields. So a layout that was
made for a log shows what flies. Unlike JSON such messages carry NaN and infinity.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.bridge.blocks import BlockSamples, is_whole, slots_of
from quadvis.bridge.parameters import BridgedParameters
from quadvis.bridge.poses import WORLD, PoseColumns, Posed, pose_columns, pose_of
from quadvis.errors import QuadvisError
from quadvis.output.log import PACKAGE, channel_facts, message_definition, message_names
from quadvis.output.mcap_messages import CDR
from quadvis.output.recording import RecordedBlock
from quadvis.output.stretch import NANOSECONDS

if TYPE_CHECKING:
    from foxglove import Context, Parameter
    from foxglove.websocket import ChannelView, Client, WebSocketServer

TRANSFORMS = "/tf"


class FoxgloveServer:
    """Serves one port, and is the SDK's listener: what clients subscribe to is wanted, and nothing else.

    ``want`` is called with the paths of blocks, ``want_pictures`` with the names of signals, in threads of
    the SDK. QuadvisError if the package is missing or the port is taken.
    """

    def __init__(
        self, name: str, host: str, port: int, parameters: BridgedParameters, say: Callable[[str], None]
    ) -> None:
        self._sdk, self._parameters, self._say = _sdk(), parameters, say
        self.want: Callable[[set[str]], None] = lambda paths: None
        self.want_pictures: Callable[[set[str]], None] = lambda names: None
        self._lock = threading.Lock()
        self._clients: dict[str, set[int]] = {}  # by the topic to which they subscribe
        self._channels: dict[str, Any] = {}  # by topic
        self._poses: dict[str, PoseColumns] = {}  # by the path of a block
        self._pictures: dict[str, str] = {}  # the name of a signal by its topic
        self._newest = 0
        self._context: Context = self._sdk.Context()
        capability = self._sdk.websocket.Capability
        try:
            self._server: WebSocketServer = self._sdk.start_server(
                name=f"quadvis {name}", host=host, port=port, context=self._context, server_listener=self,
                capabilities=[capability.Time, capability.Parameters],
            )  # fmt: skip
        except RuntimeError as error:
            why = str(error).removeprefix("FoxgloveError: Failed to bind port: ")
            raise QuadvisError(
                f"port {port} of {host} cannot be opened ({why}); name another one with --port"
            ) from None

    @property
    def port(self) -> int:
        """The port that it serves."""
        return self._server.port

    @property
    def page(self) -> str:
        """The address of Foxglove's web application with this server as its source."""
        return self._server.app_url() or ""

    def close(self) -> None:
        """End the connections."""
        self._server.stop()

    # by the follower

    def show(self, application: str, blocks: Sequence[RecordedBlock], pictures: Sequence[str]) -> None:
        """Offer the channels of an application in place of those that there are."""
        for channel in self._channels.values():
            channel.close()
        self._channels, channels = {}, self._sdk.channels
        names = message_names(block.path for block in blocks)
        columns = {block.path: pose_columns(block) for block in blocks}
        self._poses = {path: found for path, found in columns.items() if found is not None}
        self._pictures = {f"/{name.replace('.', '/')}": name for name in pictures}
        for block, name in zip(blocks, names, strict=True):
            self._channels[block.path] = self._block_channel(block, name)
        for path in self._poses:
            self._channels[_pose(path)] = channels.PoseInFrameChannel(_pose(path), context=self._context)
        if self._poses:
            self._channels[TRANSFORMS] = channels.FrameTransformsChannel(TRANSFORMS, context=self._context)
        for topic in self._pictures:
            self._channels[topic] = channels.CompressedImageChannel(topic, context=self._context)
        self._send_parameters()
        what = f"the signals of {len(blocks)} blocks" if application else ""
        self._say(f"{application}: {what}" if application else "nothing is loaded")

    def _block_channel(self, block: RecordedBlock, name: str) -> Any:
        schema = self._sdk.Schema(
            name=PACKAGE + name, encoding="ros2msg", data=message_definition(block).encode()
        )
        return self._sdk.Channel(
            block.path, schema=schema, message_encoding="cdr", context=self._context,
            metadata=channel_facts(block),
        )  # fmt: skip

    def take(self, samples: BlockSamples) -> None:
        """Publish samples, each at its stamp."""
        for block, values in samples.by_block():
            if self._is_seen(block.path):
                self._log_rows(block, samples.stamps, values)
            if block.path in self._poses and (self._is_seen(_pose(block.path)) or self._is_seen(TRANSFORMS)):
                self._log_poses(block.path, samples.stamps, values)
        self._tell_time(int(samples.stamps[-1]))

    def _log_rows(self, block: RecordedBlock, stamps: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        channel, there = self._channels[block.path], is_whole(block, values)
        for stamp, row in zip(stamps[there].tolist(), slots_of(block, values[there]), strict=True):
            channel.log(CDR + row.tobytes(), log_time=stamp)

    def _log_poses(self, path: str, stamps: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        for stamp, row in zip(stamps.tolist(), values, strict=True):
            pose = pose_of(row, self._poses[path])
            if pose is None:
                continue
            if self._is_seen(_pose(path)):
                self._channels[_pose(path)].log(self._pose_message(stamp, pose), log_time=stamp)
            if self._is_seen(TRANSFORMS):
                message = self._transforms_message(stamp, path, pose)
                self._channels[TRANSFORMS].log(message, log_time=stamp)

    def _pose_message(self, stamp: int, pose: Posed) -> Any:
        made = self._sdk.messages
        (x, y, z), (qx, qy, qz, qw) = pose
        found = made.Pose(
            position=made.Vector3(x=x, y=y, z=z), orientation=made.Quaternion(x=qx, y=qy, z=qz, w=qw)
        )
        return made.PoseInFrame(timestamp=self._timestamp(stamp), frame_id=WORLD, pose=found)

    def _transforms_message(self, stamp: int, path: str, pose: Posed) -> Any:
        made = self._sdk.messages
        (x, y, z), (qx, qy, qz, qw) = pose
        found = made.FrameTransform(
            timestamp=self._timestamp(stamp), parent_frame_id=WORLD, child_frame_id=path.strip("/"),
            translation=made.Vector3(x=x, y=y, z=z), rotation=made.Quaternion(x=qx, y=qy, z=qz, w=qw),
        )  # fmt: skip
        return made.FrameTransforms(transforms=[found])

    def _timestamp(self, stamp: int) -> Any:
        return self._sdk.messages.Timestamp(*divmod(stamp, NANOSECONDS))

    def _tell_time(self, stamp: int) -> None:
        """Let clients take the newest stamp for the present."""
        if stamp > self._newest:
            self._newest = stamp
            self._server.broadcast_time(stamp)

    def take_picture(self, name: str, found: Mapping[str, Any]) -> None:
        """Publish a picture: its message has the instant of the exposure, where the source knows it."""
        topic = next((topic for topic, known in self._pictures.items() if known == name), "")
        channel = self._channels.get(topic)
        if channel is None:
            return
        began, on_wire = int(found["began"]), float(found["time"])
        taken = on_wire if np.isnan(found["stamp"]) else float(found["stamp"])
        message = self._sdk.messages.CompressedImage(
            timestamp=self._timestamp(began + round(taken * NANOSECONDS)), frame_id=name.rpartition(".")[0],
            data=bytes(found["data"]), format=str(found["format"]),
        )  # fmt: skip
        channel.log(message, log_time=began + round(on_wire * NANOSECONDS))

    def hear(self, event: Mapping[str, Any]) -> None:
        """Tell clients what was tuned, by whomever."""
        if event.get("event") == "tuned":
            self._send_parameters([str(each["name"]) for each in event["changes"]])

    def _send_parameters(self, names: Sequence[str] = ()) -> None:
        if found := self._found_parameters(names):
            self._server.publish_parameter_values(found)

    def _found_parameters(self, names: Sequence[str]) -> list[Parameter]:
        return [
            self._sdk.Parameter(name, value=value) for name, value in self._parameters.values(names).items()
        ]

    # by the SDK, in its threads

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Want what is subscribed to."""
        with self._lock:
            self._clients.setdefault(channel.topic, set()).add(client.id)
        self._want()

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """Want it no more, once nobody does."""
        with self._lock:
            self._clients.get(channel.topic, set()).discard(client.id)
        self._want()

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """Return parameters by name, all that can be tuned without names."""
        return self._found_parameters(param_names)

    def on_set_parameters(
        self, client: Client, parameters: list[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """Tune parameters, and return their values then; a status says why they are refused."""
        try:
            self._parameters.set({each.name: each.get_value() for each in parameters})
        except QuadvisError as error:
            self._server.publish_status(str(error), self._sdk.StatusLevel.Error)
        return self._found_parameters([each.name for each in parameters])

    def on_parameters_subscribe(self, param_names: list[str]) -> None:
        """Do nothing: the SDK keeps who has subscribed to what."""

    def on_parameters_unsubscribe(self, param_names: list[str]) -> None:
        """Do nothing."""

    def _is_seen(self, topic: str) -> bool:
        return bool(self._clients.get(topic)) and topic in self._channels

    def _want(self) -> None:
        with self._lock:
            topics = {topic for topic, clients in self._clients.items() if clients}
        posed = {path for path in self._poses if {TRANSFORMS, _pose(path)} & topics}
        self.want(posed | topics)
        self.want_pictures({name for topic, name in self._pictures.items() if topic in topics})


def _pose(path: str) -> str:
    """Return the topic of the pose of a block."""
    return f"{path}/pose"


def _sdk() -> Any:
    """Return Foxglove's SDK, which is large and not required."""
    try:
        import foxglove
        import foxglove.channels
        import foxglove.messages
        import foxglove.websocket
    except ImportError as error:
        raise QuadvisError(
            "a bridge to Foxglove needs the package foxglove-sdk; install 'quadvis[foxglove]'"
        ) from error
    return foxglove
