# Copyright 2026 ahv developers, Apache-2.0
"""Whatever a bag holds, it is read or named in one sentence: no traceback, bounded memory."""

import json
import os
import shutil
import subprocess
import sys
from random import Random
from struct import pack, unpack_from

import lz4.frame
import pytest
import yaml
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType

from ahv_analysis.bag.info import bag_info
from ahv_analysis.bag.mcap_file import MAGIC
from ahv_analysis.bag.reader import load_bag
from ahv_analysis.bag.recovery import recover
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly_library
from ahv_analysis.report.page_flight import read_flights
from ahv_msgs_py.parameters import ParameterError
from test.bags import mcap_of, stock
from test.waiting import PATIENCE

ODD = [
    None,
    0,
    -1,
    2**70,
    1.5,
    float("nan"),
    True,
    "",
    "x",
    "\ud800",
    "../../etc/passwd",
    "x" * 10_000,
    [],
    [[]],
    {},
    {"a": {}},
    {1: 2},
]
NUMBERS = [0, 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1]
COMPRESSIONS = {
    b"": bytes,
    b"zstd": zstandard.ZstdCompressor(level=1).compress,
    b"lz4": lz4.frame.compress,
}


@pytest.fixture(scope="module")
def seeds(tmp_path_factory):
    """Small bags to begin with: ours, and two of stock rosbag2."""
    folder = tmp_path_factory.mktemp("seeds")
    fly_library(load_case("neuro_adaptive_di", {"duration": 0.05}), folder / "ours")
    stock(folder / "chunked", folder / "ours", CompressionType.LZ4, files=1)
    stock(folder / "loose", folder / "ours", CompressionType.NONE, use_chunking=False, files=1)
    return [folder / name for name in ("ours", "chunked", "loose")]


def records_of(data, start=0):
    """Opcodes and bodies of records one behind the other."""
    found = []
    while start + 9 <= len(data):
        opcode, length = unpack_from("<BQ", data, start)
        found.append((opcode, data[start + 9 : start + 9 + length]))
        start += 9 + length
    return found


def joined(records):
    return b"".join(pack("<BQ", opcode, len(body)) + body for opcode, body in records)


def spoilt_bytes(data, random):
    """Bytes with a few changes: bits, numbers, parts lost, doubled or made up."""
    data = bytearray(data)
    for _ in range(random.randrange(1, 4)):
        place = random.randrange(len(data) + 1)
        way = random.randrange(5)
        if way == 0 and place < len(data):
            data[place] ^= 1 << random.randrange(8)
        elif way == 1:
            size = random.choice((2, 4, 8))
            data[place : place + size] = pack("<Q", random.choice(NUMBERS))[:size]
        elif way == 2:
            del data[place : place + random.randrange(40)]
        elif way == 3:
            data[place:place] = data[place : place + random.randrange(40)]
        else:
            data[place:place] = random.randbytes(random.randrange(20))
    return bytes(data)


def spoilt_records(records, random):
    """Records in which some are changed, moved, doubled, dropped or of other opcodes."""
    records = list(records)
    for _ in range(random.randrange(1, 4)):
        place = random.randrange(len(records)) if records else 0
        opcode, body = records[place] if records else (0x80, b"")
        way = random.randrange(5)
        if way == 0:
            changed = [(opcode, spoilt_bytes(body, random))]
        elif way == 1:
            changed = [(random.choice((0, 1, 3, 4, 5, 6, 11, 12, 15, 16, 0x80, 255)), body)]
        elif way == 2:
            changed = []
        elif way == 3:
            changed = [(opcode, body)] * 2
        else:
            changed = [(opcode, body), random.choice(records or [(opcode, body)])]
        records[place : place + 1] = changed
    return records


def spoilt_chunk(body, random):
    """A chunk whose records are spoilt, and whose size and name of compression may be."""
    (name_size,) = unpack_from("<I", body, 28)
    name = body[32 : 32 + name_size]
    packed = body[40 + name_size :]
    plain = {
        b"": bytes,
        b"zstd": lambda data: zstandard.ZstdDecompressor().decompressobj().decompress(data),
        b"lz4": lz4.frame.decompress,
    }[name](packed)
    plain = joined(spoilt_records(records_of(plain), random))
    packed = COMPRESSIONS[name](plain)
    if random.randrange(4) == 0:
        packed = spoilt_bytes(packed, random)
    if random.randrange(8) == 0:
        name = random.choice((b"", b"zstd", b"lz4", b"brotli", b"\xff"))
    size = random.choice((len(plain),) * 8 + (*NUMBERS,))
    head = body[:16] + pack("<QII", size, 0, len(name))
    return head + name + pack("<Q", len(packed)) + packed


def spoilt_file(data, random):
    """An MCAP file that is spoilt somewhere, its checksums left out so that all of it is read."""
    way = random.randrange(4)
    if way == 0:
        return spoilt_bytes(data, random)
    records = [
        (15, bytes(4)) if opcode == 15 else (2, bytes(20)) if opcode == 2 else (opcode, body)
        for opcode, body in records_of(data[:-8], 8)
    ]
    if way == 1:
        records = spoilt_records(records, random)
    else:
        chunks = [place for place, (opcode, _) in enumerate(records) if opcode == 6]
        if chunks:
            place = random.choice(chunks)
            records[place] = 6, spoilt_chunk(records[place][1], random)
        else:
            records = spoilt_records(records, random)
    return MAGIC + joined(records) + MAGIC


def spoilt_tree(tree, random):
    """Content of YAML or JSON with something odd in a place."""
    if isinstance(tree, dict) and tree and random.randrange(6):
        key = random.choice(list(tree))
        way = random.randrange(8)
        if way == 0:
            return {name: value for name, value in tree.items() if name != key}
        if way == 1:
            return tree | {random.choice([value for value in ODD if value.__hash__]): tree[key]}
        return tree | {key: spoilt_tree(tree[key], random)}
    if isinstance(tree, list) and tree and random.randrange(4):
        place = random.randrange(len(tree))
        return [*tree[:place], spoilt_tree(tree[place], random), *tree[place:]]
    return random.choice(ODD)


def spoilt_metadata(text, random):
    """metadata.yaml that is spoilt: as a text, in its content, in the notes within."""
    way = random.randrange(4)
    if way == 0:
        return spoilt_bytes(text.encode(), random)
    content = yaml.load(text, yaml.CSafeLoader)
    information = content["rosbag2_bagfile_information"]
    custom = information["custom_data"] or {}
    if way == 1 and custom:
        key = random.choice(("ahv", "ahv_recovered"))
        notes = json.loads(custom.get(key) or custom["ahv"])
        custom[key] = json.dumps(spoilt_tree(notes, random), skipkeys=True)
    elif way == 2 and custom:
        custom["ahv"] = random.choice((custom["ahv"][:-5], "[" * 5000, '{"case": NaN}', "1e999"))
    else:
        content = spoilt_tree(content, random)
    return json.dumps(content, skipkeys=True).encode()  # which is YAML too


def check_a_spoilt_bag(folder, seeds, random):
    """Read, recover and measure a spoilt bag; all that may come of it is one sentence."""
    bag, out = folder / "bag", folder / "new"
    for path in (bag, out):
        shutil.rmtree(path, ignore_errors=True)
    seed = random.choice(seeds)
    bag.mkdir()
    file = mcap_of(seed)
    data, text = file.read_bytes(), (seed / "metadata.yaml").read_text()
    both = random.randrange(3)
    (bag / file.name).write_bytes(spoilt_file(data, random) if both != 1 else data)
    if random.randrange(10):
        text = spoilt_metadata(text, random) if both else text.encode()
        (bag / "metadata.yaml").write_bytes(text)
    target = random.choice((bag, bag, bag / file.name))
    readings = (
        lambda: json.dumps(bag_info(target), allow_nan=False),
        lambda: read_flights([target]),
        lambda: recover(target, out),
    )
    try:
        random.choice(readings)()
    except (BagError, ParameterError) as error:
        assert "\n" not in str(error) and len(str(error)) < 1500
    if out.exists():
        load_bag(out)  # what was recovered is whole


def fuzz(folder, seeds, examples):
    @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.randoms(use_true_random=True))
    def check(random: Random):
        check_a_spoilt_bag(folder, seeds, random)

    check()


def test_a_spoilt_bag_is_read_or_named(tmp_path, seeds):
    fuzz(tmp_path, seeds, 2_000)


@pytest.mark.slow
def test_fifty_thousand_spoilt_bags_are_read_or_named(tmp_path, seeds):
    fuzz(tmp_path, seeds, 50_000)


def chunk(name, packed, size):
    body = pack("<QQQII", 0, 0, size, 0, len(name)) + name + pack("<Q", len(packed)) + packed
    return joined([(6, body)])


def zeros(name, megabytes):
    """So many zeros, compressed without their size."""
    if name == b"lz4":
        packer = lz4.frame.LZ4FrameCompressor()
        parts = [packer.begin()]
    else:
        packer = zstandard.ZstdCompressor().compressobj()
        parts = []
    parts += [packer.compress(bytes(2**20)) for _ in range(megabytes)]
    return b"".join([*parts, packer.flush()])


ALIASES = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 10)
)
READ_ALL = """
import resource, sys
from pathlib import Path
from ahv_analysis.bag.info import bag_info
from ahv_analysis.bag.recovery import recover
from ahv_analysis.errors import BagError
start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for name in sys.argv[1:]:
    for reading in (bag_info, lambda path: recover(path, path.with_name("new"))):
        try:
            reading(Path(name))
        except BagError as error:
            print(error)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - start) // 1024, file=sys.stderr)
"""


def test_what_unpacks_without_end_and_what_never_ends_take_no_memory(tmp_path, seeds):
    header = MAGIC + joined([(1, bytes(8))])
    bomb = zeros(b"zstd", 512)
    files = {
        "zstd": header + chunk(b"zstd", bomb, 100),
        "claimed": header + chunk(b"zstd", bomb, 2**31),
        "many": header + chunk(b"zstd", zeros(b"zstd", 15), 15 * 2**20) * 100,
        "lz4": header + chunk(b"lz4", zeros(b"lz4", 256), 100),
        "whole": bomb,  # as if rosbag2 had compressed the file
    }
    bags = []
    for name, data in files.items():
        bags.append(shutil.copytree(seeds[0], tmp_path / name))
        mcap_of(bags[-1]).write_bytes(data)
    for name, text in {
        "aliases": ALIASES,
        "deep": "[" * 10**6,
        "long": "[" + "1," * 10**6,
    }.items():
        bags.append(shutil.copytree(seeds[0], tmp_path / name))
        (bags[-1] / "metadata.yaml").write_text(text)
    for name in ("fifo", "endless"):
        bags.append(shutil.copytree(seeds[0], tmp_path / name))
        file = mcap_of(bags[-1])
        file.unlink()
        os.mkfifo(file) if name == "fifo" else file.symlink_to("/dev/zero")
    done = subprocess.run(
        [sys.executable, "-c", READ_ALL, *map(str, bags)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    sentences = done.stdout.splitlines()
    assert len(sentences) >= len(bags)
    assert all(str(tmp_path) in sentence for sentence in sentences)
    assert int(done.stderr) < 45  # [MB] beyond the libraries: with these, 200 MB
