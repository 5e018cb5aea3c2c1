# Copyright 2026 ahv developers, Apache-2.0
"""A campaign is its runs: whatever flies them, wherever it stopped, each can be flown again."""

import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tracemalloc
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib import pyplot
from scipy.stats import beta

from ahv_analysis.campaign import campaign as campaign_module
from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.campaign.campaign import (
    COMPUTED_BY,
    Campaign,
    first_causes,
    fly_campaign,
    open_campaign,
)
from ahv_analysis.campaign.store import (
    PART_RUNS,
    check_columns,
    level_folder,
    part_files,
    read_part,
    write_part,
)
from ahv_analysis.campaign.summary import exact_interval, summarize_campaign
from ahv_analysis.campaign.table import CONTROLLERS, REPORT, Row, fly_table, markdown
from ahv_analysis.command import campaign as campaign_command
from ahv_analysis.errors import CampaignError, CampaignStopped
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.outcome import Cause
from ahv_analysis.report.page_figures import campaign_figures
from ahv_msgs_py.config import config_folder
from ahv_plant.numerics.identity import HOUSE
from test.test_command import ahv, told
from test.waiting import PATIENCE, wait_until

RUNS = 150
AHV = Path(sys.executable).parent / "ahv"


def campaign(name="neuro_adaptive_di", level=0.4, runs=RUNS, seed=2, random_starts=False):
    return Campaign(load_case(name, {"duration": 20.0}), level, runs, seed, random_starts)


def rows(folder, level=0.4):
    """All rows that a campaign keeps, as anybody would read them."""
    table = pq.read_table(level_folder(folder, level))
    return {name: table[name].to_numpy() for name in table.column_names}


def same(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[key], other[key]) for key in one)


def short_case(folder, name, duration):
    """File of a case with another duration [s]."""
    text = (config_folder() / "cases" / f"{name}.yaml").read_text()
    assert "duration: 150.0" in text
    path = folder / f"short_{name}.yaml"
    path.write_text(text.replace("duration: 150.0", f"duration: {duration}"))
    return path


def done(result):
    future: Future = Future()
    future.set_result(result)
    return future


class Invented:
    """An executor that makes up the results of long campaigns instead of flying them."""

    def __init__(self, pattern):
        self.pattern = pattern

    def submit(self, function, described, first, count):
        chosen = np.arange(first, first + count) % len(self.pattern["run"])
        columns = {name: column[chosen] for name, column in self.pattern.items()}
        return done(columns | {"run": np.arange(first, first + count)})


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A campaign of short flights and its folder."""
    folder = tmp_path_factory.mktemp("campaign")
    with ThreadPoolExecutor(2) as pool:
        fly_campaign(campaign(), folder, pool)
    return rows(folder), folder


def test_a_row_a_run(flown):
    table, _ = flown
    assert table["run"].tolist() == list(range(RUNS))
    assert {"CL", "Izz", "cause", "time_s", "max_abs_alpha_deg", "trim_exists"} <= table.keys()
    assert np.all(table["alpha_margin_deg"] == 5.0 - table["max_abs_alpha_deg"])
    failed = table["cause"] != 0
    assert 0 < failed.sum() < RUNS // 2
    assert np.all(table["time_s"][~failed] == 20.0) and np.all(table["time_s"][failed] < 20.0)


def test_order_of_execution_changes_nothing(flown, tmp_path):
    class Backwards(ThreadPoolExecutor):
        """An executor that runs the last job first, and only when all are there."""

        def __init__(self):
            super().__init__(1)
            self.jobs = []

        def submit(self, function, *arguments):
            future: Future = Future()
            self.jobs.append((future, function, arguments))
            if len(self.jobs) == -(-RUNS // 64):
                for waiting, work, given in reversed(self.jobs):
                    waiting.set_result(work(*given))
            return future

    fly_campaign(campaign(), tmp_path, Backwards())
    assert same(rows(tmp_path), flown[0])


def test_an_interrupted_campaign_resumes(flown, tmp_path):
    class Interrupted(ThreadPoolExecutor):
        """An executor that is interrupted in its second job."""

        def submit(self, function, described, first, count):
            if first < 64:
                return done(function(described, first, count))
            future: Future = Future()
            future.set_exception(KeyboardInterrupt())
            return future

    with pytest.raises(KeyboardInterrupt):
        fly_campaign(campaign(), tmp_path, Interrupted())
    assert rows(tmp_path)["run"].tolist() == list(range(64))
    begun = []
    with ThreadPoolExecutor(2) as pool:
        fly_campaign(campaign(), tmp_path, pool, begun.append)
    assert begun[0] == 64 and begun[-1] == RUNS
    assert same(rows(tmp_path), flown[0])


def test_more_runs_add_to_a_campaign_and_fewer_are_a_part_of_it(flown, tmp_path):
    with ThreadPoolExecutor(2) as pool:
        fly_campaign(campaign(runs=70), tmp_path, pool)
        fly_campaign(campaign(), tmp_path, pool)
        assert same(rows(tmp_path), flown[0])
        begun = []
        fly_campaign(campaign(runs=10), tmp_path, pool, begun.append)
    assert begun == [10]
    assert summarize_campaign(campaign(runs=10), tmp_path)["runs"] == 10
    assert same(rows(tmp_path), flown[0])


def test_memory_does_not_grow_with_the_campaign(flown, tmp_path):
    """Peak of flying, resuming and summing up, with numpy's and Arrow's allocations."""

    def peak(parts):
        long = campaign(runs=parts * PART_RUNS)
        folder = tmp_path / str(parts)
        tracemalloc.start()
        try:
            fly_campaign(long, folder, Invented(flown[0]))
            fly_campaign(long, folder, Invented(flown[0]))
            assert summarize_campaign(long, folder)["runs"] == parts * PART_RUNS
            return tracemalloc.get_traced_memory()[1] + pa.total_allocated_bytes()
        finally:
            tracemalloc.stop()

    peak(1)  # what is loaded once
    few, many = peak(4), peak(16)
    assert many - few < 1.0 * 12 * PART_RUNS  # less than a byte a run


def test_a_long_campaign_is_one_table_of_parts(flown, tmp_path):
    class Interrupted(Invented):
        """Stops in the second part."""

        def submit(self, function, described, first, count):
            if first == PART_RUNS + 640:
                raise KeyboardInterrupt
            return super().submit(function, described, first, count)

    long = campaign(runs=2 * PART_RUNS + 100)
    with pytest.raises(KeyboardInterrupt):
        fly_campaign(long, tmp_path, Interrupted(flown[0]))
    kept = len(rows(tmp_path)["run"])
    assert 0 < kept < long.runs
    begun = []
    fly_campaign(long, tmp_path, Invented(flown[0]), begun.append)
    assert begun[0] == kept and begun[-1] == long.runs
    assert rows(tmp_path)["run"].tolist() == list(range(long.runs))
    assert len(part_files(level_folder(tmp_path, 0.4))) == 3
    assert open_campaign(tmp_path) == long
    causes = first_causes(long, tmp_path, PART_RUNS + 5)
    assert list(causes) == list(range(PART_RUNS + 5))
    assert [causes[run] for run in range(RUNS)] == flown[0]["cause"].tolist()


@pytest.mark.parametrize(
    "change, words",
    [
        ({"seed": 3}, "seed 2 there and 3 here"),
        ({"name": "neuro_adaptive_sc_gdi"}, "case neuro_adaptive_di there"),
    ],
)
def test_another_campaign_is_not_mixed_in(flown, change, words):
    _, folder = flown
    with (
        ThreadPoolExecutor(1) as pool,
        pytest.raises(CampaignError, match="another campaign") as e,
    ):
        fly_campaign(campaign(**change), folder, pool)
    assert words in str(e.value)


@pytest.mark.parametrize("what", ["source", "numba", "llvmlite", "numpy", "processor"])
def test_a_campaign_of_other_code_is_not_mixed_in(flown, monkeypatch, what):
    other = COMPUTED_BY | {what: "another"}
    monkeypatch.setattr(campaign_module, "COMPUTED_BY", other)
    with (
        ThreadPoolExecutor(1) as pool,
        pytest.raises(CampaignError, match=f"{what} .* another here"),
    ):
        fly_campaign(campaign(), flown[1], pool)


def test_a_worker_with_other_code_is_refused_by_name(tmp_path):
    """A process whose air has another heat ratio; of a pool, or a dask worker without dask."""
    house = tmp_path / "house"
    for room in ("ahv_plant", "ahv_control", "ahv_msgs_py", "ahv_analysis"):
        shutil.copytree(HOUSE / room, house / room, ignore=shutil.ignore_patterns("__pycache__"))
    air = house / "ahv_plant" / "model" / "atmosphere.py"
    text = air.read_text()
    assert "HEAT_RATIO = 1.4 " in text
    air.write_text(text.replace("HEAT_RATIO = 1.4 ", "HEAT_RATIO = 1.41 "))
    program = (
        "import json, sys\nfrom ahv_analysis.campaign.campaign import fly_job\n"
        "print(fly_job(json.loads(sys.stdin.read()), 0, 64))"
    )
    worker = subprocess.run(
        [sys.executable, "-c", program],
        input=json.dumps(campaign().describe()),
        env=os.environ | {"PYTHONPATH": str(house)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    refusal = worker.stdout.strip()
    assert re.match(r"process \d+ on .* would compute other numbers \(source \w+ there", refusal)
    assert COMPUTED_BY["source"] + " here" in refusal and "\n" not in refusal

    class OtherCode:
        """An executor of such a process."""

        def submit(self, function, *arguments):
            return done(refusal)

    with pytest.raises(CampaignError) as error:
        fly_campaign(campaign(), tmp_path / "campaign", OtherCode())
    assert str(error.value) == refusal
    assert not part_files(level_folder(tmp_path / "campaign", 0.4))


def test_when_a_scheduler_dies_what_was_flown_is_kept(flown, tmp_path):
    class Dead(Invented):
        """An executor that gives up its second job."""

        def submit(self, function, described, first, count):
            future = super().submit(function, described, first, count)
            if first:
                future = Future()
                future.cancel()
                future.set_running_or_notify_cancel()
            return future

    with pytest.raises(
        CampaignStopped, match="what was flown is kept, and the same command resumes"
    ):
        fly_campaign(campaign(), tmp_path, Dead(flown[0]))
    assert rows(tmp_path)["run"].tolist() == list(range(64))


def test_a_folder_gives_its_campaign_back(flown):
    _, folder = flown
    assert open_campaign(folder) == campaign()
    with pytest.raises(CampaignError, match=r"holds no campaign of level 0\.3; there are: 0\.4"):
        open_campaign(folder, 0.3)
    with pytest.raises(CampaignError, match="nowhere holds no campaign"):
        open_campaign(folder / "nowhere")


def test_random_starts_spread_as_section_3_5_2_says():
    spread = campaign("nominal_di", level=0.0, random_starts=True)
    centre = spread.case.plant.initial
    starts = np.array([spread.start(run) for run in range(400)]) - np.array(centre)
    names = dict(zip(centre._fields, starts.T, strict=True))
    assert 95 < np.max(np.abs(names["u"])) <= 100.0
    assert 480 < np.max(np.abs(names["h"])) <= 500.0
    for rate in "PQR":
        assert 4.8 < np.degrees(np.max(np.abs(names[rate]))) <= 5.0 + 1e-9
    for still in ("v", "w", "phi", "theta", "psi", "x", "y", "mass"):
        assert not np.any(names[still])


def test_a_campaign_flies_the_disturbance_of_its_case(tmp_path):
    push = {"duration": 2.0, "disturbance.P.constant": 2.0, "disturbance.R.amplitude": 1.0}
    pushed = Campaign(load_case("neuro_adaptive_di", push), 0.2, 20, 1)
    with ThreadPoolExecutor(1) as pool:
        fly_campaign(pushed, tmp_path, pool)
    table = rows(tmp_path, 0.2)
    assert np.all(table["max_abs_phi_deg"] > 1e-3)
    one = pushed.case_of(7)
    alone = fly_alone(one)
    assert math.degrees(alone.max_abs_phi) == table["max_abs_phi_deg"][7]


def test_figures_of_a_campaign_with_gaps_mark_the_runs_that_failed():
    causes = {run: int(run == 70) for run in range(64, 80)}
    _, draw = campaign_figures(campaign(), causes)
    assert draw.keywords["failed"] == [run == 70 for run in range(64, 80)]
    start = campaign().case_of(64)
    assert np.array_equal(draw.keywords["flights"][0].states[0], start.plant.initial)


@pytest.mark.parametrize(
    "name, random_starts, numbers",
    [
        ("nominal_di", True, [f"3.{number}" for number in range(8, 14)]),
        ("neuro_adaptive_di", False, [f"4.{number}" for number in range(6, 11)]),
        ("neuro_adaptive_sc_gdi", False, [f"5.{number}" for number in range(6, 11)]),
    ],
)
def test_a_campaign_gives_the_report_s_figures_a_line_a_run(name, random_starts, numbers):
    few = campaign(name, level=0.0 if random_starts else 0.3, random_starts=random_starts)
    causes = {0: 0, 1: int(Cause.INLET_UNSTART), 2: 0}
    plates, draw = campaign_figures(few, causes)
    assert [plate.number for plate in plates] == numbers
    for plate in plates:
        figure = draw(plate)
        assert f"Figure {plate.number}" in figure.get_suptitle()
        for panel, axis in zip(plate.panels, figure.axes, strict=True):
            lines = [line for line in axis.lines if len(line.get_xdata()) > 2]
            assert [line.get_color() for line in lines] == ["C0", "C3", "C0"]
            assert lines[1].get_zorder() > lines[0].get_zorder()
            for run, line in enumerate(lines):
                flight = draw.keywords["flights"][run]
                assert np.array_equal(line.get_ydata(), panel.values(flight))
                assert line.get_xdata()[-1] == 20.0
        pyplot.close(figure)


def damaged(path, kind):
    if kind == "no parquet":
        path.write_text("hello")
    elif kind == "a folder":
        path.mkdir()
    else:
        table = pa.table({"other" if kind == "no runs" else "run": [1]})
        described = {
            "no description": {},
            "bad description": {"ahv": "{"},
            "no runs": {"ahv": "{}"},
        }
        pq.write_table(table.replace_schema_metadata(described[kind]), path)


@pytest.mark.parametrize(
    "kind", ["no parquet", "a folder", "no description", "bad description", "no runs"]
)
def test_a_damaged_campaign_is_named(tmp_path, kind):
    path = tmp_path / "runs-0.3" / "part-000000000.parquet"
    path.parent.mkdir()
    damaged(path, kind)
    with pytest.raises(CampaignError, match=r"part-0+\.parquet is not the file of a campaign"):
        open_campaign(tmp_path)


def test_two_levels_never_share_a_folder(tmp_path):
    names = {level_folder(tmp_path, level).name for level in (0.1234567, 0.12345671, 0.123457)}
    assert names == {"runs-0.1234567", "runs-0.12345671", "runs-0.123457"}
    assert level_folder(tmp_path, 0.0).name == "runs-0"  # as ever


def test_a_flipped_bit_is_noticed_and_its_runs_are_flown_anew(flown, tmp_path):
    folder = tmp_path / "campaign"
    shutil.copytree(flown[1], folder)
    (part,) = part_files(level_folder(folder, 0.4))
    whole, good = part.read_bytes(), read_part(part)
    draw = np.random.default_rng(1)
    noticed = 0
    for place, bit in zip(*draw.integers((len(whole), 8), size=(200, 2)).T, strict=True):
        part.write_bytes(whole[:place] + bytes([whole[place] ^ (1 << bit)]) + whole[place + 1 :])
        try:
            columns, described = read_part(part)
        except CampaignError as error:
            noticed += 1
            words = f"{part} is not the file of a campaign, or is damaged"
            assert str(error).startswith(words) and "its runs are flown anew" in str(error)
        else:  # in what Parquet keeps beside rows and description
            assert same(columns, good[0]) and described == good[1]
    assert noticed > 100
    in_a_page = whole[:3000] + bytes([whole[3000] ^ 1]) + whole[3001:]
    part.write_bytes(in_a_page)
    with ThreadPoolExecutor(2) as pool, pytest.raises(CampaignError, match="damaged"):
        fly_campaign(campaign(), folder, pool)
    with pytest.raises(CampaignError, match="damaged"):
        summarize_campaign(campaign(), folder)
    part.unlink()
    fly_campaign(campaign(), folder, Invented(flown[0]))
    assert part.read_bytes() == whole


@pytest.mark.parametrize(
    "name, value",
    [
        ("run", 9),
        ("CL", -1.0),
        ("cause", max(Cause) + 1),
        ("max_abs_phi_deg", -1.0),
        ("final_altitude_m", 5e4),
        ("final_speed_mps", math.nan),
        ("trim_alpha_deg", 100.0),
    ],
)
def test_a_value_that_cannot_be_is_named(flown, name, value):
    columns = {key: column.copy() for key, column in flown[0].items()}
    check_columns(columns, 0)
    assert columns["trim_exists"][10]
    columns[name][10] = value
    with pytest.raises(ValueError, match=r"its runs" if name == "run" else f"{name} of run 10 is"):
        check_columns(columns, 0)


def test_a_level_without_runs_is_named(tmp_path):
    (tmp_path / "runs-0.3").mkdir()
    with pytest.raises(CampaignError, match=r"runs-0\.3 holds no runs of a campaign"):
        open_campaign(tmp_path)


@pytest.mark.parametrize("successes, runs", [(0, 50), (50, 50), (3580, 3602)])
def test_intervals_are_exact(successes, runs):
    low, high = exact_interval(successes, runs)
    assert low == pytest.approx(
        beta.ppf(0.025, successes, runs - successes + 1) if successes else 0.0
    )
    assert high == pytest.approx(
        beta.ppf(0.975, successes + 1, runs - successes) if successes < runs else 1.0
    )


def test_the_summary_counts(flown):
    table, folder = flown
    summary = summarize_campaign(campaign(), folder)
    assert summary["successes"] == np.sum(table["cause"] == 0)
    assert summary["flown_s"] == pytest.approx(np.sum(table["time_s"]))
    assert summary["runs"] == RUNS == summary["successes"] + sum(summary["failures"].values())
    assert summary["success_rate"] == summary["successes"] / RUNS
    low, high = summary["interval"]
    assert low < summary["success_rate"] < high


def test_the_table_has_the_report_s_counts(tmp_path):
    assert sum(row.trials for row in REPORT) == 14832
    with ThreadPoolExecutor(2) as pool:
        done = []
        rows = fly_table(tmp_path, pool, 1, 16, True, done.append)
    assert [row.flown["controller"] for row in rows] == [
        f"{name}_protected" for name in CONTROLLERS for _ in REPORT
    ]
    assert done[-1] == 8 * 16
    text = markdown(rows)
    assert text.count("\n") == 2 + 8
    assert "| 99.39 | [99.08, 99.6" in text and "| 89.21 | [88.19, 90.1" in text


@pytest.mark.parametrize(
    "successes, runs, verdict",
    [
        (3, 3, "within"),  # of three flights nothing follows
        (3602, 3602, "above"),
        (3594, 3602, "within"),
        (3560, 3602, "below"),
        (0, 3, "below"),
    ],
)
def test_a_rate_is_apart_only_if_neither_lies_in_the_other_s_interval(successes, runs, verdict):
    flown = {"success_rate": successes / runs, "interval": exact_interval(successes, runs)}
    assert Row(3602, 3594, exact_interval(3594, 3602), flown).verdict == verdict


@pytest.fixture(scope="module")
def cluster():
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True
    ) as cluster:
        yield cluster


def test_the_command_flies_the_same_campaign_on_a_dask_cluster(flown, cluster, tmp_path):
    case = short_case(tmp_path, "neuro_adaptive_di", "20.0")
    command = ("monte-carlo", "--controller", case, "--level", 0.4, "--runs", RUNS, "--seed", 2)
    out = tmp_path / "campaign"
    result = ahv(*command, "--dask", cluster.scheduler_address, "--out", out, "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["runs"] == RUNS
    assert same(rows(out), flown[0])


def test_dask_outlives_a_worker(flown, cluster, tmp_path):
    from distributed import Client

    with Client(cluster) as client, client.get_executor(pure=False, retries=10) as pool:
        victim = next(iter(cluster.workers.values()))
        killed = []

        def kill(done):
            if not killed:
                killed.append(victim.pid)
                victim.process.process._process.kill()

        fly_campaign(campaign(), tmp_path, pool, kill)
    assert killed
    assert same(rows(tmp_path), flown[0])


def test_the_command_flies_reruns_and_draws(tmp_path):
    out = tmp_path / "campaign"
    command = ("monte-carlo", "--controller", "neuro_adaptive_di", "--level", 0.4, "--runs", 20)
    result = ahv(*command, "--seed", 2, "--out", out, "--json")
    assert result.returncode == 0, result.stderr
    summary = json.loads(result.stdout)
    keys = "controller level runs successes success_rate interval failures"
    assert set(keys.split()) | {"trial_steps_per_second", "wall_s"} <= set(summary)
    assert (summary["controller"], summary["level"]) == ("neuro_adaptive_di", 0.4)
    again = told("monte-carlo", "rerun", out, 6, "--json")
    assert json.loads(again.stdout)["same_bits"] is True, again.stdout
    assert again.returncode == 0
    (part,) = part_files(level_folder(out, 0.4))
    columns, described = read_part(part)
    columns = {name: column.copy() for name, column in columns.items()}
    columns["final_altitude_m"][5] += 1e-9
    write_part(part, [columns], described)
    again = told("monte-carlo", "rerun", out, 5, "--json")
    assert again.returncode == 1
    assert json.loads(again.stdout)["differing"] == ["final_altitude_m"]
    assert again.stderr.strip() == "ahv: run 5 differs from the campaign's in final_altitude_m"
    figures = told("figures", out, "--runs", 6, "--out", tmp_path / "figures", "--json")
    assert figures.returncode == 0, figures.stderr
    names = {Path(name).name for name in json.loads(figures.stdout)["figures"]}
    assert names == {f"figure_4_{n}.{kind}" for n in range(6, 11) for kind in ("png", "svg")}


def test_a_run_can_be_flown_on_the_graph(tmp_path):
    out = tmp_path / "campaign"
    case = short_case(tmp_path, "nominal_di", "20.0")
    fly = ("monte-carlo", "--controller", case, "--random-starts", "--level", 0.0)
    assert ahv(*fly, "--runs", 3, "--out", out, "--json").returncode == 0
    result = ahv("monte-carlo", "rerun", out, 2, "--graph", "--out", tmp_path / "run", "--json")
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["same_bits"] is True and found["ended_early"] == ""
    from ahv_analysis.bag.reader import read_bag

    flight = read_bag(Path(found["bag"]))
    assert flight.steps == 2000
    assert np.max(np.abs(np.degrees(flight.air.alpha))) == pytest.approx(
        found["max_abs_alpha_deg"], rel=1e-12
    )


def test_ctrl_c_keeps_what_was_flown(tmp_path):
    out, case = tmp_path / "campaign", short_case(tmp_path, "nominal_di", "1.0")
    heard = ("env", "--default-signal=INT")  # also where tests run in the background of a shell
    command = (*heard, AHV, "monte-carlo", "--controller", case)
    command = (*command, "--runs", "9000000", "--out", out)
    process = subprocess.Popen([*map(str, command)], stderr=subprocess.PIPE, text=True)
    wait_until(lambda: part_files(out / "runs-0.3"), "a part of the campaign is on disk")
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "resumes" in errors and "Traceback" not in errors
    kept = int(re.search(r"after (\d+) of 9000000", errors)[1])
    assert len(rows(out, 0.3)["run"]) >= kept >= PART_RUNS


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("monte-carlo", "--controller", "nope"), ("nope", "neuro_adaptive_di")),
        (("monte-carlo", "--level", 2.0), ("level 2", "0 to 0.9")),
        (("monte-carlo", "--runs", 0), ("--runs",)),
        (("monte-carlo", "rerun", "nowhere", 1), ("nowhere", "no campaign")),
        (("table", "--runs", "many"), ("--runs", "many")),
        (("table", "--profile", "loop"), ("profile 'loop'", "waypoints")),
        (("figures", ".", "--out", "x"), ("not a bag",)),
        (("monte-carlo", "--runs", 1, "--out", sys.executable), ("cannot hold a campaign",)),
    ],
)
def test_wrong_input_is_named(arguments, words, tmp_path):
    result = told(*arguments, cwd=tmp_path)
    assert result.returncode == 2, result.stderr
    assert result.stdout == "" and "Traceback" not in result.stderr
    assert all(word in result.stderr for word in words), result.stderr


def test_a_scheduler_that_is_not_there_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign_command, "LONGEST_SEARCH", "0.5s")
    command = ("monte-carlo", "--runs", 1, "--dask", "tcp://127.0.0.1:9")
    result = told(*command, cwd=tmp_path)
    assert (result.returncode, result.stdout) == (2, "")
    assert "no dask scheduler" in result.stderr and "Traceback" not in result.stderr
