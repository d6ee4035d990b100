"""Messages of ROS 2 in MCAP files that other programs have written, played by `sources.recording`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer as PlainWriter
from mcap_ros2.writer import Writer as RosWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.errors import QuadvisError
from quadvis.output.foreign_signals import read_recording
from quadvis.output.ros_layout import MessageError, layout
from quadvis.output.ros_schema import NUMBERS, read_schema
from quadvis.output.ros_signals import read_messages
from quadvis.output.ros_standard import DEFINITIONS
from quadvis.testing import drive
from quadvis_blocks.sources.recording import Recording

STORE = get_typestore(Stores.ROS2_HUMBLE)
START = 1_700_000_000_000_000_000  # ns: clocks of ROS count from 1970
MS = 1_000_000


def made(kind: str, **fields: Any) -> Any:
    """Return a message of rosbags."""
    return STORE.types[f"{kind.partition('/')[0]}/msg/{kind.partition('/')[2]}"](**fields)


def header(number: int, frame: str = "base") -> Any:
    return made(
        "std_msgs/Header", stamp=made("builtin_interfaces/Time", sec=number, nanosec=5), frame_id=frame
    )


def vector(kind: str, *values: float) -> Any:
    return made(f"geometry_msgs/{kind}", **dict(zip("xyzw", values, strict=False)))


def imu(number: int) -> Any:
    return made(
        "sensor_msgs/Imu",
        header=header(number, "imu" * (number % 3)),  # texts of changing length move the numbers
        orientation=vector("Quaternion", 0.1, 0.2, 0.3, number),
        orientation_covariance=np.arange(9.0),
        angular_velocity=vector("Vector3", number, 2 * number, 3 * number),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector("Vector3", 0.5, -number, 9.81),
        linear_acceleration_covariance=np.zeros(9),
    )


def odometry(number: int) -> Any:
    pose = made(
        "geometry_msgs/Pose",
        position=vector("Point", number, 0.0, 1.0),
        orientation=vector("Quaternion", 0.0, 0.0, 0.0, 1.0),
    )
    twist = made(
        "geometry_msgs/Twist",
        linear=vector("Vector3", 1.0, 2.0, 3.0),
        angular=vector("Vector3", 4.0, 5.0, 6.0),
    )
    return made(
        "nav_msgs/Odometry",
        header=header(number),
        child_frame_id="odd",
        pose=made("geometry_msgs/PoseWithCovariance", pose=pose, covariance=np.full(36, number * 1.0)),
        twist=made("geometry_msgs/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    )


def joints(number: int) -> Any:
    return made(
        "sensor_msgs/JointState",
        header=header(number),
        name=["left", "right" * number],
        position=np.array([number, -number], float),
        velocity=np.zeros(number % 2),
        effort=np.zeros(0),
    )


def bag(folder: Path, topics: dict[str, tuple[str, list[Any]]]) -> Path:
    """Write messages of rosbags, 10 ms apart, into an MCAP file as `ros2 bag record -s mcap` does."""
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, (kind, messages) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for number, message in enumerate(messages):
                writer.write(connection, START + number * 10 * MS, STORE.serialize_cdr(message, kind))
    return folder / "bag" / "bag.mcap"


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    numbers = [made("std_msgs/Float64", data=0.5 * number) for number in range(7)]
    return bag(
        tmp_path_factory.mktemp("flight"),
        {
            "/craft/imu": ("sensor_msgs/msg/Imu", [imu(number) for number in range(7)]),
            "/odom": ("nav_msgs/msg/Odometry", [odometry(number) for number in range(7)]),
            "/height": ("std_msgs/msg/Float64", numbers),
            "/joints": ("sensor_msgs/msg/JointState", [joints(number) for number in range(7)]),
            "/wind": ("geometry_msgs/msg/Vector3", [vector("Vector3", n, n, 2 * n) for n in range(7)]),
        },
    )


def test_standard_messages_have_names_values_and_units(flight: Path) -> None:
    found = read_recording(flight)
    count = np.arange(7.0)
    assert found.stamps("height.data").tolist() == [10 * MS * number for number in range(7)]
    np.testing.assert_array_equal(found["height.data"], 0.5 * count)
    rates = np.stack([count, 2 * count, 3 * count], axis=1)
    np.testing.assert_array_equal(found["craft/imu.angular_velocity"], rates)
    np.testing.assert_array_equal(found["/craft/imu.angular_velocity.z"], 3 * count)
    np.testing.assert_array_equal(found["craft/imu.orientation[3]"], count)
    assert found["craft/imu.orientation_covariance"].shape == (7, 9)
    assert found["craft/imu.header.stamp.sec"].tolist() == list(range(7))
    np.testing.assert_array_equal(found["odom.pose.pose.position.x"], count)
    np.testing.assert_array_equal(found["odom.pose.covariance[35]"], count)
    assert found["odom.twist.twist.angular"].tolist() == [[4.0, 5.0, 6.0]] * 7
    np.testing.assert_array_equal(found["joints.position"], np.stack([count, -count], axis=1))
    np.testing.assert_array_equal(found["wind"][:, 2], 2 * count)
    np.testing.assert_array_equal(found["wind.y"], count)
    units = {
        "craft/imu.angular_velocity": "rad/s", "craft/imu.linear_acceleration.y": "m/s^2", "wind": "1",
        "odom.pose.pose.position": "m", "odom.twist.twist.linear.x": "m/s", "odom.pose.covariance": "1",
    }  # fmt: skip
    assert {name: found.units[name] for name in units} == units
    assert not found.damage


def test_what_is_no_signal_has_a_reason(flight: Path) -> None:
    with pytest.raises(
        QuadvisError, match=r"'joints.velocity': it has 0 to 1 elements, and not always as many"
    ):
        read_recording(flight).find("joints.velocity")
    with pytest.raises(ParameterError, match=r"did you mean 'craft/imu\.angular_velocity'"):
        Recording(file=str(flight), signal="craft/imu.angular_velocty")


def test_a_diagram_plays_a_bag_between_its_messages(flight: Path) -> None:
    text = f"""
quadvis: 1
name: play
rates: {{fast: 200 Hz}}
stop_time: 20 ms
blocks:
  imu:
    block: sources.recording
    rate: fast
    with: {{file: {flight}, signal: /craft/imu.angular_velocity, between: linear}}
  angle: {{block: signal.gain, rate: fast, with: {{factor: 2 s}}, in: {{u: "imu.y[1]"}}}}
"""
    result = load_text(text).run()
    assert result.units["angle.y"] == "rad"
    np.testing.assert_allclose(result["angle.y"], [0.0, 2.0, 4.0, 6.0, 8.0], rtol=1e-12)
    held = drive(Recording(file=str(flight), signal="height.data"), rate="200 Hz", steps=4).y
    assert held.tolist() == [0.0, 0.0, 0.5, 0.5]


def test_any_message_is_read_by_the_definition_in_the_file(tmp_path: Path) -> None:
    """mcap-ros2-support writes the messages of a type that nobody knows."""
    text = """\
uint8 FREE=0  # a constant
string<=10 label
lab_msgs/Part[] parts
Part main
int16[3] raw
float32[<=4] few 
bool ready
uint8[] picture
================================================================================
MSG: lab_msgs/Part
string name "none"
float64 level 1.5
"""
    path = tmp_path / "lab.mcap"
    with open(path, "wb") as file:
        writer = RosWriter(file)
        schema = writer.register_msgdef("lab_msgs/msg/State", text)
        for number in range(5):
            parts = [{"name": "x" * each, "level": 1.0} for each in range(number % 3)]
            message = {
                "label": "n" * number, "parts": parts, "main": {"name": "main", "level": number / 4},
                "raw": [number, -number, 7], "few": [0.5, number], "ready": number % 2 == 1,
                "picture": b"\x01" * number,
            }  # fmt: skip
            writer.write_message("/lab", schema, message, log_time=START + number, publish_time=0)
        writer.finish()
    found = read_messages(path)
    assert found.names == ("lab.main.level", "lab.raw", "lab.few", "lab.ready")
    np.testing.assert_array_equal(found["lab.main.level"], np.arange(5) / 4)
    assert found["lab.raw"].tolist() == [[number, -number, 7] for number in range(5)]
    assert found["lab.few"].tolist() == [[0.5, number] for number in range(5)]
    assert found["lab.ready"].tolist() == [False, True, False, True, False]
    assert found.stamps("lab.raw").tolist() == [0, 1, 2, 3, 4]


def plain(
    path: Path, schema: tuple[str, str, bytes], encoding: str, messages: list[tuple[int, bytes]]
) -> Path:
    """Write messages by the mcap library, as they are."""
    with open(path, "wb") as file:
        writer = PlainWriter(file)
        writer.start()
        name, language, text = schema
        number = writer.register_channel("/a", encoding, writer.register_schema(name, language, text))
        for time, data in messages:
            writer.add_message(number, time, data, time)
        writer.finish()
    return path


def test_our_definitions_are_those_of_ros() -> None:
    for name in DEFINITIONS:
        full = name.replace("/", "/msg/")
        text, _ = STORE.generate_msgdef(full, ros_version=2)
        assert read_schema(name, "") == read_schema(full, text)


def test_messages_out_of_order_and_without_a_definition(tmp_path: Path) -> None:
    """Recorders write chunks whose times overlap; some leave the definitions of standard messages out."""
    data = [
        STORE.serialize_cdr(made("std_msgs/Float64", data=float(each)), "std_msgs/msg/Float64")
        for each in "123"
    ]
    order = [(START + 2, data[1]), (START, data[0]), (START + 2, data[2])]
    found = read_messages(plain(tmp_path / "a.mcap", ("std_msgs/msg/Float64", "ros2msg", b""), "cdr", order))
    assert found["a.data"].tolist() == [1.0, 2.0, 3.0] and found.stamps("a.data").tolist() == [0, 2, 2]


@pytest.mark.parametrize(
    ("schema", "encoding", "sentence"),
    [
        (
            ("a.B", "protobuf", b"\xff"),
            "protobuf",
            "its messages are 'protobuf'; CDR with definitions of ROS 2",
        ),
        (("a/msg/B", "ros2idl", b"module a {};"), "cdr", "its messages are 'ros2idl'; CDR"),
        (("a/msg/B", "ros2msg", b"C c"), "cdr", "the file has no definition of 'a/C'"),
        (("a/msg/B", "ros2msg", b"B c"), "cdr", "'a/B' holds itself"),
        (("a/msg/B", "ros2msg", b"wstring c"), "cdr", "texts of the kind wstring, which are not read"),
        (("a/msg/B", "ros2msg", b"[3] c"), "cdr", "the line '[3] c', which is no field"),
        (("a/msg/B", "ros2msg", b""), "cdr", "no definition of 'a/B', which is no standard message"),
        (("a/msg/B", "ros2msg", b"float64 c"), "cdr", "topic 'a' has no messages that can be read"),
    ],
)
def test_what_cannot_be_played_gets_a_sentence(
    schema: tuple[str, str, bytes], encoding: str, sentence: str, tmp_path: Path
) -> None:
    path = plain(tmp_path / "a.mcap", schema, encoding, [(5, b"\0\1\0\0"), (6, b"")])
    with pytest.raises(QuadvisError) as caught:
        read_recording(path)
    assert f"'{path}' has no numbers of ROS 2 to play: " in str(caught.value) and sentence in str(
        caught.value
    )


def test_a_bag_that_was_cut_is_played_as_far_as_it_goes(flight: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(flight.read_bytes()[:-400])
    found = read_recording(path)
    assert f"'{path}' is played as far as it goes" in found.damage
    assert len(found["height.data"]) == 7
    assert str(Recording(file=str(path), signal="height.data").doubts()[0]).endswith("cut short or damaged")


PRIMITIVES = st.sampled_from(sorted(set(NUMBERS) - {"byte", "char"}))


@st.composite
def described(draw: Any) -> tuple[str, dict[str, Any]]:
    """Return the definition of a message of numbers, arrays and texts, and one of its values."""
    lines, values = [], {}
    for number, kind in enumerate(
        draw(st.lists(st.one_of(PRIMITIVES, st.just("string")), min_size=1, max_size=8))
    ):
        name = f"f{number}"
        if kind == "string":
            lines.append(f"string {name}")
            values[name] = draw(st.text("abc", max_size=9))
            continue
        count = draw(st.none() | st.integers(1, 5))
        some = np.frombuffer(
            draw(st.binary(min_size=40, max_size=40)), np.dtype(NUMBERS[kind].replace("b1", "u1"))
        )
        array = np.nan_to_num(some[: count or 1]) if kind != "bool" else some[: count or 1] % 2 == 1
        sequence = count is not None and draw(st.booleans()) and kind not in ("uint8", "int8")
        lines.append(f"{kind}{'' if count is None else '[]' if sequence else f'[{count}]'} {name}")
        values[name] = array[0].item() if count is None else array
    return "\n".join(lines), values


@given(described(), st.booleans())
@settings(max_examples=15, deadline=None)
def test_numbers_lie_where_rosbags_puts_them(described: tuple[str, dict[str, Any]], little: bool) -> None:
    text, values = described
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, "a/msg/B"))
    data = bytes(store.serialize_cdr(store.types["a/msg/B"](**values), "a/msg/B", little_endian=little))
    found = layout(read_schema("a/msg/B", text), "a/B", data)
    assert found.fits(data)
    got = {each.name: each for each in found.numbers if each.name}
    assert set(got) == {name for name, value in values.items() if not isinstance(value, str)}
    for name, each in got.items():
        count = int(np.prod(each.shape, dtype=int))
        read = np.frombuffer(data, each.type, count, each.start).reshape(each.shape)
        np.testing.assert_array_equal(read, values[name])


@given(st.binary(max_size=60))
@settings(max_examples=60, deadline=None)
def test_any_bytes_are_a_message_or_not(data: bytes) -> None:
    text = "string a\nfloat64[] b\nC[] c\n===\nMSG: x/C\nstring[] d\nint8 e"
    try:
        found = layout(read_schema("x/B", text), "x/B", data)
    except MessageError:
        return
    assert all(each.start <= len(data) for each in found.numbers)


@given(place=st.integers(8, 5000), byte=st.integers(0, 255))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_changed_byte_is_survived(flight: Path, tmp_path: Path, place: int, byte: int) -> None:
    data = bytearray(flight.read_bytes())
    data[place % len(data)] = byte
    path = tmp_path / "changed.mcap"
    path.write_bytes(data)
    try:
        read_recording(path)
    except QuadvisError as error:
        assert str(path) in str(error)
