# Copyright 2026 ahv developers, Apache-2.0
"""A law of one's own is one file and flies everywhere to the same bits; a bad one harms no one."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.command.app import app
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.replay.inputs import read_recording
from ahv_analysis.replay.replay import replay
from ahv_analysis.replay.result import total
from ahv_analysis.report.summary import summarize
from ahv_control.law_file import law_identity, load_law
from ahv_control.own_law import TROUBLES
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.model.constants import DEGREES, RADIANS, SURFACE_MAXIMUM, SURFACE_MINIMUM
from test.documents import ROOT

MINE = ROOT / "examples" / "my_law" / "my_lqr.py"
ARRAYS = ("states", "attitude_commands", "rate_commands", "surfaces", "throttle")
SHORT = {"duration": 2.0}
HEAD = """
import math
from typing import NamedTuple

from ahv_control.law import Commands, direct
from ahv_plant.model.vectors import Surfaces
from ahv_plant.numerics.elementwise import elementwise, select

class Settings(NamedTuple):
    elevons: float = -0.12  # [rad] of both
    loud: bool = False

def start(measured, reference, settings):
    return 0.0, direct(Surfaces(settings.elevons, settings.elevons, 0.0), 0.3)
"""
STEP = "def step(memory, before, commands, measured, reference, settings):\n    "
FIXED = "return memory + 1.0, direct(Surfaces(settings.elevons, settings.elevons, 0.0), 0.3)\n"


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def written(folder, body, head=HEAD, name="mine"):
    """A law file whose step is a `body`."""
    path = folder / f"{name}.py"
    path.write_text(head + STEP + body)
    return str(path)


def of_bits(record):
    return [np.asarray(getattr(record, name)[:]).tobytes() for name in ARRAYS]


@pytest.fixture(scope="module")
def case():
    return load_case("nominal_di", {"duration": 4.0}, hardware="typical", law=str(MINE))


@pytest.fixture(scope="module")
def record(case):
    return record_of(fly(case), geometric=False)


@pytest.mark.unit
def test_a_law_of_one_file_flies_like_one_of_the_report(record):
    """It turns the same vehicle from the same start, by gains of its own."""
    summary = summarize(record, "")
    assert summary["success"] and summary["max_abs_alpha_deg"] < 4.0
    ours = record_of(fly(load_case("nominal_di", SHORT)), geometric=False)
    assert not np.array_equal(ours.surfaces[0], record.surfaces[0])


@pytest.mark.graph
def test_on_the_graph_it_commands_the_same_bits_and_again_in_a_replay(
    case, record, tmp_path, domain
):
    fly_graph(case, tmp_path / "bag", domain=domain)
    assert of_bits(read_bag(tmp_path / "bag")) == of_bits(record)
    flown = replay(read_recording(tmp_path / "bag"), case, case.controllers)
    again = total(flown.comparisons)
    assert (again["compared"], again["differences"], again["missing"]) == (4 * 401, 0, 0)
    page = run("report", tmp_path / "bag", "--out", tmp_path / "page")
    assert "success" in page.output and "altitude_error" in (
        next((tmp_path / "page").glob("*.html")).read_text()
    )


@pytest.mark.unit
@pytest.mark.compiled
@pytest.mark.parametrize("hardware", ["ideal", pytest.param("typical", marks=pytest.mark.slow)])
def test_a_lane_is_a_flight_alone(hardware):
    case = load_case("nominal_di", SHORT, hardware=hardware, law=str(MINE))
    campaign = Campaign(case, 0.2, 3, 7)
    rows = fly_runs(campaign, 0, 3)
    for run_number in range(3):
        for name, column in fly_again(campaign, run_number).items():
            assert np.array_equal(column[0], rows[name][run_number], equal_nan=True), name


@pytest.mark.unit
def test_in_plain_python_it_is_the_same_law(case, record, tmp_path):
    path = tmp_path / "plain.py"
    path.write_text(MINE.read_text().replace("@elementwise\ndef st", "def st"))
    plain = load_case("nominal_di", {"duration": 4.0}, hardware="typical", law=str(path))
    assert not load_law(str(MINE)).why_plain
    assert load_law(str(path)).why_plain.endswith("of plain.py are not marked @elementwise")
    assert of_bits(record_of(fly(plain), geometric=False)) == of_bits(record)
    assert not np.any(record.rate_commands[:]), "it commands none"


@pytest.mark.unit
def test_a_setting_is_a_parameter_of_the_node_and_changes_the_flight(tmp_path):
    law = written(tmp_path, FIXED)
    file = tmp_path / "flown.yaml"
    text = (ROOT / "config" / "cases" / "nominal_di.yaml").read_text()
    own = "\n/**/flight_control: {ros__parameters: {law: mine.py, elevons: -0.1}}\n"
    file.write_text(text + own)
    flown = load_case(str(file), SHORT)
    assert flown.parameters["flight_control"]["law"] == law, "beside the case"
    assert next(fly(flown)).commands.surfaces.left_elevon == -0.1
    assert load_law(law).parameters[0][:4] == ("elevons", -0.12, "of both", "rad")
    file.write_text(text + own.replace("elevons", "elevon"))
    with pytest.raises(ParameterError, match="no parameter 'elevon'; did you mean 'elevons'"):
        load_case(str(file), SHORT)


@pytest.mark.unit
@pytest.mark.parametrize(
    ("body", "cause", "raised"),
    [
        ("if memory > 9: raise ValueError('lost')\n    " + FIXED, "law_failed", "lost"),
        ("return memory, None\n", "law_failed", "and not Commands"),
        ("return memory, direct(Surfaces(math.nan, 0.0, 0.0), 0.3)\n", "law_failed", ""),
        ("raise SystemExit(3)\n", "law_failed", "SystemExit: 3"),
        (FIXED, "success", ""),
    ],
    ids=["raises", "no commands", "no number", "exits", "sound"],
)
def test_a_law_that_fails_ends_no_program_and_is_named(body, cause, raised, tmp_path):
    law = written(tmp_path, body)
    TROUBLES.clear()
    options = ("--engine", "library", "--duration", 0.3, "--out", tmp_path / "flight")
    flown = run("fly", "nominal_di", "--law", law, *options, "--json")
    assert flown.exit_code == 0, flown.output
    summary = json.loads(flown.stdout)
    assert summary["cause"] == cause and summary["steps"] == 30
    said = summary["law"]["raised"]
    assert all("mine.py" in text for text in said) and any(raised in text for text in said or [""])
    campaign = Campaign(load_case("nominal_di", {"duration": 0.3}, law=law), 0.0, 1, 0)
    assert fly_runs(campaign, 0, 1)["cause"][0] == (6 if cause == "law_failed" else 0)


@pytest.mark.unit
def test_what_is_asked_beyond_the_stops_is_held_there(tmp_path):
    law = written(tmp_path, "return memory, direct(Surfaces(1e9, -1e9, 0.0), -7.0)\n")
    flown = [step.commands for step in fly(load_case("nominal_di", {"duration": 0.2}, law=law))]
    assert flown[-1].surfaces[:2] == (SURFACE_MAXIMUM, SURFACE_MINIMUM)
    assert (flown[-1].throttle, flown[-1].status) == (0.1, 1), "and it is said"
    assert pytest.approx(30.0) == SURFACE_MAXIMUM * DEGREES and RADIANS * DEGREES == 1.0


MARKED = HEAD.replace("def start", "@elementwise\ndef start") + "\n@elementwise\n"


@pytest.mark.unit
@pytest.mark.parametrize(
    ("body", "words"),
    [
        (
            "if memory > 9.0:\n        return memory, commands\n    " + FIXED,
            "a branch on",
        ),
        ("memory = math.sin(memory)\n    " + FIXED, "math.sin()"),
        ("memory = memory ** 2\n    " + FIXED, "a power"),
        ("memory = select(0 < memory < 9, 1.0, 2.0)\n    " + FIXED, "two comparisons"),
        ("memory = select((memory > 1.0) and (memory < 9.0), 1.0, 2.0)\n    " + FIXED, "`and`"),
    ],
    ids=["branch", "libm", "power", "chain", "and"],
)
def test_what_keeps_a_law_from_the_lanes_is_said_with_its_line(body, words, tmp_path):
    law = written(tmp_path, body, MARKED)
    line = Path(law).read_text().splitlines().index(STEP.splitlines()[0]) + 2
    with pytest.raises(ParameterError) as refused:
        load_law(law)
    assert f"mine.py, line {line}: " in str(refused.value) and words in str(refused.value)


@pytest.mark.unit
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no function start(measured, reference, settings)"),
        (HEAD, "has no function step(memory, before"),
        (HEAD + "def step(memory):\n    pass\n", "has step() of 1 arguments"),
        ((HEAD + STEP + FIXED).replace("Settings", "Setting"), "has no Settings"),
        ((HEAD + STEP + FIXED).replace(" = -0.12", ""), "Settings.elevons has no default"),
        ((HEAD + STEP + FIXED).replace("= -0.12", "= ()"), "Settings.elevons is tuple"),
        ((HEAD + STEP + FIXED).replace("elevons:", "guided:"), "that the node has already"),
        ("1 / 0\n", "line 1: ZeroDivisionError"),
        ("def\n", "line 1: SyntaxError"),
        ("raise SystemExit(3)\n", "line 1: SystemExit: 3"),
        (HEAD + STEP + FIXED + "def design(settings):\n    return {}[1]\n", "design() failed"),
    ],
)
def test_a_file_that_is_no_law_is_refused_in_a_sentence(text, words, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(text)
    refused = run("fly", "nominal_di", "--engine", "library", "--law", path, "--out", tmp_path)
    assert refused.exit_code == 2 and words in refused.output.replace("\n", " ")
    assert refused.output.count("\n") == 1 and not list(tmp_path.glob("bag"))


@pytest.mark.unit
def test_what_another_source_flew_is_not_replayed(tmp_path):
    law = written(tmp_path, FIXED)
    before = law_identity(law)
    flight = tmp_path / "flight"
    fly_it = ("fly", "nominal_di", "--engine", "library", "--duration", 0.1, "--out", flight)
    assert run(*fly_it, "--law", law).exit_code == 0
    written(tmp_path, "# the same\n    " + FIXED)
    assert law_identity(law) == before, "a comment is no change"
    written(tmp_path, FIXED.replace("1.0", "2.0"))
    assert law_identity(law) != before
    refused = run("replay", flight / "bag")
    assert refused.exit_code == 2 and "another source of its law" in refused.output
