"""The server for Foxglove, by a client that is written from the specification of its protocol."""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from quadvis.bridge.follower import Follower
from quadvis.bridge.foxglove import FoxgloveServer
from quadvis.bridge.parameters import READ_ONLY, BridgedParameters
from quadvis.bridge.pictures import PictureWatch
from quadvis.errors import QuadvisError
from tests.processes import wait_for
from tests.quadvis.bridge.scripted import BEGAN, FoxgloveClient, ScriptedTarget, following

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
MS = 1_000_000
TOPICS = {"/craft", "/craft/pose", "/law", "/eyes/detector", "/eyes/camera/frame", "/tf"}


@contextmanager
def bridged(target: ScriptedTarget, *names: str, tunes: bool = False) -> Iterator[tuple[FoxgloveClient, Any]]:
    """Yield a client of a bridge to a target, and the sentences that the bridge says."""
    said: list[str] = []
    server = FoxgloveServer("lab", "127.0.0.1", 0, BridgedParameters(target, tunes), said.append)
    pictures = PictureWatch(target, server.take_picture)
    try:

        def before(follower: Follower) -> None:
            server.want, server.want_pictures = follower.want, pictures.want

        with (
            following(target, server, *names, said=said, before=before),
            FoxgloveClient.at(server.port) as client,
        ):
            yield client, said
    finally:
        pictures.close()
        server.close()


def decoded(channel: dict[str, Any], data: bytes) -> Any:
    """Return a message as others decode it: by mcap-ros2-support, or by Google's protobuf."""
    if channel["encoding"] == "cdr":
        schema = Schema(1, channel["schema"].encode(), channel["schemaEncoding"], channel["schemaName"])
        decode = DecoderFactory().decoder_for("cdr", schema)
        assert decode is not None
        return decode(data)
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    files = descriptor_pb2.FileDescriptorSet.FromString(b64decode(channel["schema"] + "=="))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))
    return kind.FromString(data)


def test_channels_are_those_of_a_log_and_more() -> None:
    with bridged(ScriptedTarget()) as (client, said):
        client.until(lambda: client.channels.keys() == TOPICS)
        assert client.info["name"] == "quadvis lab" and {"time", "parameters"} <= set(
            client.info["capabilities"]
        )
        craft = client.channels["/craft"]
        assert (craft["encoding"], craft["schemaEncoding"]) == ("cdr", "ros2msg")
        assert craft["schemaName"] == "quadvis_msgs/msg/Craft"
        assert craft["schema"] == "float64[3] position  # m\nfloat64[3] attitude  # rad\n"
        assert craft["metadata"]["rate"] == "fast"
        assert client.channels["/craft/pose"]["schemaName"] == "foxglove.PoseInFrame"
        assert client.channels["/tf"]["schemaName"] == "foxglove.FrameTransforms"
        assert client.channels["/eyes/camera/frame"]["schemaName"] == "foxglove.CompressedImage"
        assert said == ["scripted: the signals of 3 blocks"]


def test_only_what_somebody_looks_at_is_acquired_and_its_values_and_stamps_are_right() -> None:
    target = ScriptedTarget()
    with bridged(target) as (client, _):
        client.until(lambda: client.channels.keys() == TOPICS)
        assert target.scopes == {}
        client.subscribe("/craft", "/law")
        client.until(lambda: target.scope_of("law.level") and target.scope_of("craft.position"))
        assert len(target.scopes) == 1  # for both, since they are of one task
        assert target.scopes[1]["NumSamples"] == 5  # 50 ms
        rows = [[0.01, 1, 2, 3, 0.1, 0.2, np.inf, 7], [0.02, 4, 5, 6, 0.3, 0.4, 0.5, np.nan]]
        target.samples("law.level", rows)
        client.until(lambda: len(client.messages.get("/craft", [])) == 2 and "/law" in client.messages)
        client.until(lambda: client.times)
        stamps, data = zip(*client.messages["/craft"], strict=True)
        assert stamps == (BEGAN + 10 * MS, BEGAN + 20 * MS)
        craft = decoded(client.channels["/craft"], data[0])
        assert list(craft.position) == [1, 2, 3] and list(craft.attitude) == [0.1, 0.2, np.inf]
        ((stamp, law),) = client.messages["/law"]  # of the second one there is no whole number yet
        assert stamp == stamps[0] and decoded(client.channels["/law"], law).level == 7
        assert client.times == [BEGAN + 20 * MS]
        client.send("unsubscribe", subscriptionIds=[1, 2])
        client.until(lambda: target.scopes == {})


def test_poses_have_the_axes_of_foxglove() -> None:
    target = ScriptedTarget()
    with bridged(target) as (client, _):
        client.until(lambda: client.channels.keys() == TOPICS)
        client.subscribe("/craft/pose", "/tf")
        client.until(lambda: target.scope_of("craft.attitude"))
        target.samples("craft.attitude", [[0.5, 1.0, 2.0, 3.0, 0.0, 0.0, np.pi / 2]])
        client.until(lambda: "/tf" in client.messages and "/craft/pose" in client.messages)
        ((stamp, data),) = client.messages["/craft/pose"]
        message = decoded(client.channels["/craft/pose"], data)
        assert stamp == BEGAN + 500 * MS == message.timestamp.ToNanoseconds()
        assert message.frame_id == "world"
        place, turn = message.pose.position, message.pose.orientation
        assert (place.x, place.y, place.z) == (1.0, -2.0, 3.0)
        assert (turn.z, turn.w) == pytest.approx((-np.sqrt(0.5), np.sqrt(0.5)))  # clockwise is negative there
        ((_, data),) = client.messages["/tf"]
        (transform,) = decoded(client.channels["/tf"], data).transforms
        assert (transform.parent_frame_id, transform.child_frame_id) == ("world", "craft")
        assert transform.timestamp.ToNanoseconds() == stamp and transform.translation.y == -2.0


def test_a_picture_comes_once_with_the_instant_of_its_exposure() -> None:
    target = ScriptedTarget()
    with bridged(target) as (client, _):
        client.until(lambda: client.channels.keys() == TOPICS)
        client.subscribe("/eyes/camera/frame")
        client.until(lambda: client.messages)
        wait_for(lambda: sum(verb == "picture" for verb, _ in target.calls) > 3)
        target.sequence = 2
        client.until(lambda: len(client.messages["/eyes/camera/frame"]) >= 2)
        first, *_ = client.messages["/eyes/camera/frame"]
        message = decoded(client.channels["/eyes/camera/frame"], first[1])
        assert (message.format, message.data) == ("jpeg", b"\xff\xd8picture")
        assert message.timestamp.ToNanoseconds() == BEGAN + 900 * MS and first[0] == BEGAN + 1000 * MS


def test_parameters_are_read_and_without_leave_not_changed() -> None:
    target = ScriptedTarget()
    with bridged(target) as (client, _):
        client.send("getParameters", parameterNames=[], id="all")
        client.until(lambda: "all" in client.answers)
        assert client.parameters == {"law.gain": "2.0 rad/s", "law.limit": "inf", "law.on": True}
        client.send("setParameters", parameters=[{"name": "law.gain", "value": "3 rad/s"}], id="set")
        client.until(lambda: "set" in client.answers and client.statuses)
        assert client.statuses == [READ_ONLY]
        assert client.parameters["law.gain"] == "2.0 rad/s" == target.values["law.gain"]


def test_parameters_are_tuned_and_all_who_look_hear_of_it() -> None:
    target = ScriptedTarget()
    with bridged(target, tunes=True) as (client, _):
        client.until(lambda: client.channels)
        client.send("subscribeParameterUpdates", parameterNames=["law.gain"])
        client.send("setParameters", parameters=[{"name": "law.gain", "value": "3 rad/s"}], id="set")
        client.until(lambda: "set" in client.answers)
        assert client.parameters["law.gain"] == "3 rad/s" == target.values["law.gain"]
        client.send("setParameters", parameters=[{"name": "law.gain", "value": 4}], id="wrong")
        client.until(lambda: "wrong" in client.answers and client.statuses)
        assert client.statuses == ["'law.gain' is in rad/s"] and client.parameters["law.gain"] == "3 rad/s"
        target.request("setparam", values={"law.gain": "5 rad/s"})  # by another host
        client.until(lambda: client.parameters["law.gain"] == "5 rad/s")
        client.send("setParameters", parameters=[{"name": "law.gain"}], id="unset")
        client.until(lambda: "unset" in client.answers and len(client.statuses) == 2)
        assert client.statuses[1] == "the parameter 'law.gain' cannot be removed; give it a value"


def test_another_application_has_its_own_channels() -> None:
    target = ScriptedTarget()
    with bridged(target) as (client, said):
        client.until(lambda: client.channels.keys() == TOPICS)
        client.subscribe("/craft")
        client.until(lambda: target.scopes)
        target.application = ""
        target.takers["event"]({"event": "unloaded"}, None)
        client.until(lambda: not client.channels)
        assert said[-1] == "nothing is loaded"


def test_signals_and_pictures_are_chosen() -> None:
    with bridged(ScriptedTarget(), "law.*") as (client, _):
        client.until(lambda: client.channels.keys() == {"/law"})


def test_a_port_that_is_taken_is_refused_in_a_sentence() -> None:
    parameters = BridgedParameters(ScriptedTarget(), False)
    server = FoxgloveServer("lab", "127.0.0.1", 0, parameters, print)
    try:
        with pytest.raises(QuadvisError, match=r"cannot be opened \(Address already in use.*--port"):
            FoxgloveServer("lab", "127.0.0.1", server.port, parameters, print)
    finally:
        server.close()


def test_a_missing_package_is_refused_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "foxglove", None)
    with pytest.raises(QuadvisError, match=r"needs the package foxglove-sdk; install 'quadvis\[foxglove\]'"):
        FoxgloveServer("lab", "127.0.0.1", 0, BridgedParameters(ScriptedTarget(), False), print)
