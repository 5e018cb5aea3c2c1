# Copyright 2026 ahv developers, Apache-2.0
"""The walk through an MCAP file reads what is whole, sees what is not, and never stumbles."""

import io
from struct import pack

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Channel, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from ahv_analysis.bag.mcap_file import McapFile
from ahv_analysis.bag.mcap_scan import Block, Damage
from ahv_analysis.bag.mcap_scan import scan as scan_file
from ahv_analysis.bag.plain_file import PlainFile

pytestmark = pytest.mark.unit

CHUNKS, PER_CHUNK = 4, 5
BODIES = [b"%06d" % number * 4 for number in range(CHUNKS * PER_CHUNK)]


def record(number):
    """A message of channel 1 at a time of as many nanoseconds, as `McapFile` takes it."""
    body = BODIES[number]
    return pack("<BQHIQQ", 5, 22 + len(body), 1, 0, number, number) + body


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A file of ours with a few chunks."""
    path = tmp_path_factory.mktemp("file") / "a.mcap"
    file = McapFile(path, "test")
    file.add_metadata(Metadata("one", {"two": "three"}))
    file.add_schema(Schema(id=1, data=b"float64 x", encoding="ros2msg", name="test/msg/X"))
    file.add_channel(Channel(1, "/x", "cdr", {}, 1))
    for first in range(0, len(BODIES), PER_CHUNK):
        numbers = range(first, first + PER_CHUNK)
        records = b"".join(map(record, numbers))
        places = range(0, len(records), len(record(0)))
        file.add_chunk(records, {1: np.array([*zip(numbers, places, strict=True)], np.uint64)})
    file.finish()
    return path.read_bytes()


def of_mcap(compression, **options):
    """A file of the same messages by the writer of the mcap package."""
    sink = io.BytesIO()
    writer = Writer(sink, compression=compression, **options)
    writer.start("ros2")
    schema = writer.register_schema("test/msg/X", "ros2msg", b"float64 x")
    channel = writer.register_channel("/x", "cdr", schema)
    for number, body in enumerate(BODIES):
        writer.add_message(channel, number, body, number)
    writer.finish()
    return sink.getvalue()


@pytest.fixture(scope="module", autouse=True)
def scratch(tmp_path_factory):
    """Where `scan` puts its file."""
    global SCRATCH
    SCRATCH = tmp_path_factory.mktemp("scan") / "scanned.mcap"


def scan(data):
    SCRATCH.write_bytes(data)
    with PlainFile(SCRATCH) as file:
        yield from scan_file(file)


def bodies(pieces):
    return [
        piece.body(place)
        for piece in pieces
        if isinstance(piece, Block)
        for place in range(len(piece.starts))
    ]


def damage(pieces):
    return [piece for piece in pieces if isinstance(piece, Damage)]


def flipped(data, place, bit=0):
    return data[:place] + bytes([data[place] ^ 1 << bit]) + data[place + 1 :]


def test_a_whole_file_is_read_and_has_no_damage(whole):
    pieces = list(scan(whole))
    assert bodies(pieces) == BODIES and not damage(pieces)
    assert {type(piece) for piece in pieces} >= {Schema, Channel, Metadata}


def test_mcap_agrees_with_every_checksum_of_ours(whole):
    records = list(StreamReader(io.BytesIO(whole), validate_crcs=True).records)
    assert [found.data for found in records if hasattr(found, "log_time")] == BODIES


@given(place=st.integers(0, 10**6), bit=st.integers(0, 7))
def test_every_flipped_bit_is_seen(whole, place, bit):
    pieces = list(scan(flipped(whole, place % len(whole), bit)))
    assert damage(pieces)
    kept = bodies(pieces)
    assert [body for body in BODIES if body in kept] == kept  # nothing made up, order kept
    assert len(kept) >= len(BODIES) - PER_CHUNK  # one chunk at most is lost


@given(size=st.integers(0, 10**6))
def test_a_file_cut_off_gives_its_beginning(whole, size):
    pieces = list(scan(whole[: size % len(whole)]))
    kept = bodies(pieces)
    assert damage(pieces) and kept == BODIES[: len(kept)]


@given(junk=st.binary(max_size=300), place=st.integers(0, 10**6), gap=st.integers(0, 300))
def test_any_nonsense_in_a_file_is_survived(whole, junk, place, gap):
    for data in (whole, of_mcap(CompressionType.NONE, use_chunking=False, enable_data_crcs=True)):
        start = place % len(data)
        broken = data[:start] + junk + data[start + gap :]
        assert broken == data or damage(list(scan(broken)))


def test_messages_in_no_chunk_are_walked_to_the_end_whatever_bit_is_flipped():
    data = of_mcap(CompressionType.NONE, use_chunking=False, enable_data_crcs=True)
    for place in range(8 * data.index(BODIES[2]), 8 * data.index(BODIES[3])):
        assert damage(list(scan(flipped(data, place // 8, place % 8))))


def test_behind_a_hole_it_goes_on_with_the_next_chunk(whole):
    lost = whole.index(b"zstd")
    hole = whole[: lost - 45] + bytes(60) + whole[lost + 15 :]  # the head of the first chunk
    assert bodies(scan(hole)) == BODIES[PER_CHUNK:]


@pytest.mark.parametrize("compression", CompressionType)
@pytest.mark.parametrize("use_chunking", [True, False])
def test_files_of_another_writer_are_read(compression, use_chunking):
    pieces = list(scan(of_mcap(compression, use_chunking=use_chunking, chunk_size=150)))
    assert bodies(pieces) == BODIES and not damage(pieces)


@pytest.mark.parametrize("compression", CompressionType)
def test_a_chunk_that_was_being_written_gives_the_records_that_are_there(compression):
    sink = io.BytesIO()
    writer = Writer(sink, compression=compression)
    writer.start("ros2")
    schema = writer.register_schema("test/msg/X", "ros2msg", b"float64 x")
    channel = writer.register_channel("/x", "cdr", schema)
    noise = [np.random.default_rng(number).bytes(200_000) for number in range(3)]
    for number, body in enumerate(noise):
        writer.add_message(channel, number, body, number)
    writer.flush()
    pieces = list(scan(sink.getvalue()[:-220_000]))
    assert bodies(pieces) == noise[:1]
    assert "1 messages at its end have no checksum" in damage(pieces)[0].what
