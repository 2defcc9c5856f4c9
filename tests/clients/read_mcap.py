"""Reads every channel of an MCAP file with PyPI's mcap, and checks types, frames and signals.

    python3 tests/clients/read_mcap.py FILE

The flight is case 1 for at least 4 s: the left elevator jams at +30 deg after 3 s.
"""

import importlib
import math
import sys
from collections import Counter

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def check_against_foxglove(descriptor):
    """Each field has the name, number, type and label that Foxglove's own package has."""
    name = descriptor.full_name.split(".")[-1]
    theirs = getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name).DESCRIPTOR
    for field in descriptor.fields:
        other = theirs.fields_by_name[field.name]
        same = [(one.number, one.type, one.is_repeated) for one in (field, other)]
        assert same[0] == same[1], (descriptor.full_name, field.name, same)
        if field.enum_type is not None:
            values = [[(value.name, value.number) for value in one.enum_type.values] for one in (field, other)]
            assert values[0] == values[1], values
        if field.message_type is not None and field.message_type.full_name.startswith("foxglove."):
            check_against_foxglove(field.message_type)


def main():
    with open(sys.argv[1], "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        messages = list(reader.iter_decoded_messages())
    counts = Counter()
    first = {}
    for schema, channel, message, decoded in messages:
        assert schema.name == decoded.DESCRIPTOR.full_name, (channel.topic, schema.name)
        if schema.name.startswith("foxglove.") and channel.topic not in first:
            check_against_foxglove(decoded.DESCRIPTOR)
        first.setdefault(channel.topic, decoded)
        counts[channel.topic] += 1
    channels = {channel.topic: channel.id for channel in summary.channels.values()}
    for topic, number in channels.items():
        assert counts[topic] == summary.statistics.channel_message_counts[number] > 0, topic
    for topic in ["/tf", "/scene", "/location", "/estimate", "/events", "/truth", "/control", "/sensors"]:
        assert topic in channels, topic
    frames = {entity.frame_id for entity in first["/scene"].entities}
    children = {transform.child_frame_id for transform in first["/tf"].transforms}
    assert frames == children | {"world"}, (frames, children)
    clouds = {topic.split("/")[-1] for topic in channels if topic.startswith("/points/")}
    assert clouds | {"track"} == {entity.id for entity in first["/scene"].entities}, clouds

    truth = {message.log_time: decoded for _, channel, message, decoded in messages if channel.topic == "/truth"}
    for _, channel, message, decoded in messages:
        if channel.topic != "/tf":
            continue
        true = truth[message.log_time]
        by_child = {transform.child_frame_id: transform for transform in decoded.transforms}
        body, elevator = by_child["body"], by_child["body/left elevator"].rotation
        assert body.timestamp.seconds * 10**9 + body.timestamp.nanos == message.log_time
        position = (body.translation.y, body.translation.x, -body.translation.z)
        assert position == (true.position_north_m, true.position_east_m, true.position_down_m)
        angle = 2 * math.atan2(math.hypot(elevator.x, elevator.y, elevator.z), elevator.w)
        assert abs(angle - abs(true.position_left_elevator_rad)) < 1e-9, (message.log_time, angle)
    last = truth[max(truth)]
    assert abs(math.degrees(last.position_left_elevator_rad) - 30) < 0.01, last.position_left_elevator_rad
    print(f"{len(messages)} messages of {len(channels)} channels")


if __name__ == "__main__":
    main()
