# Copyright 2026 ahv developers, Apache-2.0
"""Identity is what computes: nothing else voids a campaign or compiled code, and nothing less."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from ahv_analysis.campaign import campaign
from ahv_plant.numerics import cache
from ahv_plant.numerics.identity import HOUSE, Definition, definitions, identity

SOURCES = sorted(
    path.relative_to(HOUSE)
    for path in HOUSE.glob("ahv_*/**/*.py")
    if "__pycache__" not in str(path)
)
ROOTS = {
    "campaign": ("ahv_analysis/campaign/campaign.py", "fly_runs"),
    "law": ("ahv_control/flight_control.py", None),
    "vehicle": ("ahv_plant/vehicle.py", "vehicle_step"),
}


@pytest.fixture
def house(tmp_path):
    """A copy of the package's sources."""
    for source in SOURCES:
        (tmp_path / source).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(HOUSE / source, tmp_path / source)
    return tmp_path


def identities(house):
    """Identity of each root in a house of its own, read by a process that has imported nothing."""
    program = f"""
import json, sys
from pathlib import Path
from ahv_plant.numerics.identity import Definition, identity
print(json.dumps({{name: identity(Definition(Path({str(house)!r}) / source, function))
                  for name, (source, function) in {ROOTS!r}.items()}}))
"""
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    return json.loads(found.stdout)


def test_a_comment_in_any_file_changes_no_identity(house):
    before = identities(house)
    assert before["campaign"] == campaign.COMPUTED_BY["source"]
    for source in SOURCES:
        text = (house / source).read_text()
        (house / source).write_text(f"# a comment\n\n{text}\n# another\n")
    assert identities(house) == before


@pytest.mark.parametrize(
    "source, old, new, changed",
    [
        (
            "ahv_control/outer_loop.py",
            "settings.k_h * (",
            "2.0 * settings.k_h * (",
            "campaign law",
        ),
        ("ahv_plant/model/atmosphere.py", "HEAT_RATIO = 1.4", "HEAT_RATIO = 1.41", "all"),
        ("ahv_plant/numerics/simd.py", "align=8", "align=16", "campaign"),
        (
            "ahv_plant/dispersion.py",
            "uniform(-level, level",
            "normal(0.0, level",
            "campaign",
        ),
        (
            "ahv_analysis/campaign/campaign.py",
            '"initial.u": 100.0',
            '"initial.u": 90.0',
            "campaign",
        ),
        ("ahv_analysis/report/figures.py", "C0", "C7", ""),
        ("ahv_plant/numerics/cache.py", "500_000_000", "400_000_000", ""),
    ],
)
def test_a_change_changes_the_identity_of_what_reaches_it(house, source, old, new, changed):
    before = identities(house)
    text = (house / source).read_text()
    assert old in text
    (house / source).write_text(text.replace(old, new))
    after = identities(house)
    differing = {name for name in ROOTS if after[name] != before[name]}
    assert differing == ({*ROOTS} if changed == "all" else {*changed.split()})


TRACED = """
import sys
from ahv_analysis.campaign.campaign import Campaign, fly_runs
from ahv_analysis.flight.case import load_case

called = set()

def trace(frame, event, _):
    if event == "call" and "ahv_" in frame.f_code.co_filename:
        called.add((frame.f_code.co_filename, frame.f_code.co_qualname.partition(".")[0]))

cases = [load_case(name, {"duration": 0.05})
         for name in ("nominal_di", "neuro_adaptive_di", "neuro_adaptive_sc_gdi_protected")]
sys.setprofile(trace)
for case in cases:
    for starts in (False, True):
        fly_runs(Campaign(case, 0.3, 2, 1, starts), 0, 2)
sys.setprofile(None)
for source, name in sorted(called):
    print(source, name)
"""


def test_all_that_is_called_by_a_campaign_is_in_its_identity():
    result = subprocess.run(
        [sys.executable, "-c", TRACED],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    found = definitions(Definition(HOUSE / ROOTS["campaign"][0], "fly_runs"))
    known = {f"{source} {name}" for source, name in found}
    # a comprehension or lambda of a module belongs to a statement of it, as do a tuple's makings
    called = {line for line in result.stdout.splitlines() if "<" not in line.split()[1]}
    assert len(called) > 80
    assert called <= known, called - known


LAW = """
from helper import gain
from ahv_plant.numerics.elementwise import kernel

@kernel
def law(x):
    return gain(x)
"""
HELPER = """
from ahv_plant.numerics.elementwise import elementwise

@elementwise
def gain(x):
    return 2.0 * x
"""
FLY = """
from law import law
print(law(1.0), sum(law.stats.cache_hits.values()))
"""


@pytest.fixture
def laws(tmp_path):
    """Files of somebody's own law, which takes a function from another file."""
    for name, text in (("law", LAW), ("helper", HELPER), ("fly", FLY)):
        (tmp_path / f"{name}.py").write_text(text)
    return tmp_path


def fly(laws, cache="cache"):
    """Result of the law, whether its code was found in the cache, and what was said."""
    environment = {key: os.environ[key] for key in os.environ if key != "NUMBA_DISABLE_JIT"}
    environment |= {"XDG_CACHE_HOME": str(laws / cache), "PYTHONDONTWRITEBYTECODE": "1"}
    result = subprocess.run(
        [sys.executable, laws / "fly.py"], env=environment, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    value, hits = result.stdout.split()
    return float(value), hits == "1", result.stderr


def change(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_a_changed_callee_in_another_file_is_compiled_and_a_comment_is_not(laws):
    assert fly(laws) == (2.0, False, "")
    assert fly(laws) == (2.0, True, "")
    change(laws / "helper.py", "    return", "    # twice\n    return")
    change(laws / "law.py", "@kernel", "# a comment\n@kernel")
    assert fly(laws) == (2.0, True, "")
    change(laws / "helper.py", "2.0 * x", "3.0 * x")
    assert fly(laws) == (3.0, False, "")
    change(laws / "helper.py", "3.0 * x", "2.0 * x")
    assert fly(laws) == (2.0, True, "")


def test_damaged_code_is_compiled_again_and_replaced(laws):
    fly(laws)
    kept = sorted((laws / "cache" / "ahv").iterdir())
    whole = [path.read_bytes() for path in kept]
    assert len(kept) == 2
    for damage in (
        lambda content: b"",
        lambda content: content[: len(content) // 2],
        lambda content: content[:-1] + bytes([content[-1] ^ 1]),
        lambda content: b"hello" * 100,
    ):
        for path, content in zip(kept, whole, strict=True):
            path.write_bytes(damage(content))
        assert fly(laws) == (2.0, False, "")
        assert sorted((laws / "cache" / "ahv").iterdir()) == kept
    assert fly(laws) == (2.0, True, "")


def test_a_cache_that_cannot_be_written_is_done_without(laws):
    (laws / "cache").write_text("no folder")
    for _ in range(2):
        value, hit, said = fly(laws)
        assert (value, hit) == (2.0, False)
        assert said.count("\n") == 1 and str(laws / "cache" / "ahv") in said
        assert "XDG_CACHE_HOME" in said


def test_a_full_disk_is_named_and_leaves_no_draft(monkeypatch, tmp_path, caplog):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(os, "replace", full)
    cache.save(tmp_path / "ahv" / "f.code", b"code")
    cache.save(tmp_path / "ahv" / "g.code", b"code")
    assert len(caplog.messages) == 1
    assert f"{tmp_path / 'ahv'} cannot keep compiled code (No space left" in caplog.text
    assert not list((tmp_path / "ahv").iterdir())


def test_what_was_not_used_for_longest_goes_first(monkeypatch, tmp_path):
    monkeypatch.setattr(cache, "LIMIT", 1000)
    for age in range(5):
        path = tmp_path / f"{age}.code"
        path.write_bytes(bytes(400))
        os.utime(path, (1e9 - age, 1e9 - age))
    old = tmp_path / "9581271616e38338" / "numerics_123"
    old.mkdir(parents=True)
    (old / "sin_cos.nbi").write_bytes(b"")
    cache.save(tmp_path / "new.code", b"code")
    assert {path.name for path in tmp_path.iterdir()} == {"new.code", "0.code", "1.code"}


def test_numba_still_has_what_the_cache_uses():
    import numba
    from numba.core import caching, compiler, serialize

    dispatcher = numba.njit(lambda x: x)
    missing = [
        what
        for what, there in {
            "Dispatcher._cache": hasattr(dispatcher, "_cache"),
            "NullCache.load_overload": hasattr(caching.NullCache, "load_overload"),
            "NullCache.save_overload": hasattr(caching.NullCache, "save_overload"),
            "CompileResult._reduce": hasattr(compiler.CompileResult, "_reduce"),
            "CompileResult._rebuild": hasattr(compiler.CompileResult, "_rebuild"),
            "serialize.dumps": hasattr(serialize, "dumps"),
        }.items()
        if not there
    ]
    assert not missing, f"numba {numba.__version__} lacks {', '.join(missing)}"


def test_an_identity_is_short_and_stable():
    root = Definition(HOUSE / ROOTS["vehicle"][0], "vehicle_step")
    assert identity(root) == identity(root) and len(identity(root)) == 16
