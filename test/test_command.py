# Copyright 2026 ahv developers, Apache-2.0
"""The `ahv` command: numbers as JSON, one sentence and exit code 2 for what cannot be."""

import json
import os
import subprocess
import sys
from contextlib import chdir
from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from ahv_analysis.command.app import app
from ahv_analysis.flight.case import case_names
from ahv_msgs_py.node.faults import fault_rows
from ahv_plant.model.vectors import State
from test.waiting import PATIENCE


def ahv(*arguments, cwd=None, **environment):
    """Run the command as a process of its own, in the ROS domain of this one."""
    return subprocess.run(
        [Path(sys.executable).parent / "ahv", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=os.environ | environment,
        timeout=PATIENCE,
    )


def told(*arguments, cwd="."):
    """Run the command in this process, which has all that it imports: for what it says."""
    with chdir(cwd):
        end = CliRunner().invoke(
            app, [*map(str, arguments)], prog_name="ahv", catch_exceptions=False
        )
    return subprocess.CompletedProcess(arguments, end.exit_code, end.stdout, end.stderr)


def assert_refused(result, words, folder):
    """One sentence with these words, exit code 2, and nothing left behind."""
    assert result.returncode == 2, result.stderr
    assert result.stdout == "" and "Traceback" not in result.stderr
    assert result.stderr.count("\n") == 1
    assert all(word in result.stderr for word in words), result.stderr
    assert not list(folder.iterdir())


def test_trim_as_json():
    result = told("trim", "--json")
    found = json.loads(result.stdout)
    assert result.returncode == 0
    assert found["w_mps"] == pytest.approx(91.878, abs=5e-4)
    assert found["theta_deg"] == pytest.approx(2.9442, abs=5e-5)
    assert found["right_elevon_deg"] == pytest.approx(-7.2163, abs=5e-5)
    assert found["left_elevon_deg"] == pytest.approx(-7.2163, abs=5e-5)
    assert found["throttle"] == pytest.approx(0.19417, abs=5e-6)
    assert found["residual"] < 1e-9
    assert found["converged"] is True
    keys = "u_mps v_mps w_mps theta_deg alpha_deg right_elevon_deg left_elevon_deg rudder_deg"
    assert set(keys.split()) | {"throttle", "residual", "converged"} <= set(found)


def test_trim_as_a_table():
    result = told("trim")
    assert result.returncode == 0
    assert "91.878" in result.stdout and "theta_deg" in result.stdout


def test_a_trim_is_rounded_to_what_is_meant():
    found = json.loads(told("trim", "--json").stdout)
    assert (found["v_mps"], found["rudder_deg"]) == (0.0, 0.0)


def test_a_trim_out_of_limits_is_told_by_words_and_exit_code():
    result = told("trim", "--altitude", 9000, "--speed", 2500)
    assert result.returncode == 1
    assert result.stderr == "ahv: the trim is out of reach: throttle 1.5643 (0.1 to 0.9)\n"


def test_what_a_newcomer_types_first():
    version = ahv("--version")
    assert (version.returncode, version.stderr) == (0, "")
    assert version.stdout.startswith("ahv 0.")
    bare = ahv()
    assert (bare.returncode, bare.stderr) == (0, "")
    assert bare.stdout == told("-h").stdout == told("--help").stdout
    assert "..." not in bare.stdout.replace("[ARGS]...", "")  # no text is cut
    names = [line.split()[0] for line in bare.stdout.partition("Commands:\n")[2].splitlines()]
    in_order = "fly figures report bag replay monte-carlo table map compare sensitivity worst rare"
    assert " ".join(names) == f"{in_order} faults trim linearise"
    flying = told("fly", "--help").stdout
    assert all(name in flying.replace(",", " ").split() for name in case_names())


@pytest.mark.parametrize("group", ["bag", "monte-carlo", "faults"])
def test_help_texts_are_whole(group):
    commands = told(group, "--help").stdout.partition("Commands:\n")[2]
    assert commands and "..." not in commands


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("trim", "--mass", "nan"), "mass nan kg"),
        (("trim", "--nope"), "--nope"),
        (("--nope",), "--nope"),
        (("fly", "nominal_di", "--duration", 1.005), "whole steps of 0.01 s"),
    ],
)
def test_with_json_errors_are_json(arguments, words, tmp_path):
    result = told(*arguments, "--json", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (2, "")
    assert words in json.loads(result.stdout)["error"]


@pytest.mark.parametrize("arguments", [("trim", "--json"), ("trim",), ("--help",)])
def test_output_that_nobody_reads_ends_in_silence(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    command = [Path(sys.executable).parent / "ahv", *arguments]
    result = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, timeout=PATIENCE)
    os.close(writer)
    assert (result.returncode, result.stderr) == (141, b"")


def test_a_full_disk_is_named():
    with open("/dev/full", "w") as full:
        command = [Path(sys.executable).parent / "ahv", "trim", "--json"]
        result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, timeout=PATIENCE)
    assert result.returncode == 2
    assert result.stderr.startswith(b"ahv: ") and result.stderr.count(b"\n") == 1


def test_a_terminal_without_width_shows_all():
    assert ahv("trim", COLUMNS="0").stdout == ahv("trim").stdout


def test_eighty_columns_cut_no_word_of_the_faults():
    words = ahv("faults", COLUMNS="80").stdout
    assert max(map(len, words.splitlines())) <= 80
    assert {word for row in fault_rows() for text in row for word in text.split()} <= {
        *words.split()
    }


ODD = "x[/red] [bold]Grün :smile: \udcff"  # markup, an emoji code, and a byte that is no text


IN_TURN = """
import json, sys
from ahv_analysis.command.main import prepare
prepare()
from ahv_analysis.command.app import app
for arguments in json.loads(sys.argv[1]):
    try:
        app(arguments)
    except SystemExit as end:
        if end.code:
            raise
    print(end="\\0")
"""


def test_a_name_is_never_markup_and_no_output_fails_for_its_characters(tmp_path):
    """All commands about a flight, in a folder and on a terminal as odd as can be."""
    odd = {"PYTHONIOENCODING": "ascii", "MPLBACKEND": "nonsense"}
    out, bag = tmp_path / ODD, f"{ODD}/bag"
    commands = (
        ("fly", "neuro_adaptive_di", "--engine", "library", "--duration", "0.2", "--out", ODD),
        ("bag", "info", bag),
        ("bag", "recover", bag),
        ("bag", "export", bag, "--csv", f"{out}/flight.csv"),
        ("figures", bag, "--out", f"{out}/figures"),
        ("report", bag, "--out", f"{out}/pages"),
        ("replay", bag, "--out", f"{out}/replayed"),
    )
    result = subprocess.run(
        [sys.executable, "-c", IN_TURN, json.dumps(commands)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | odd,
        timeout=PATIENCE,
    )
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    *said, rest = result.stdout.split("\0")
    assert (len(said), rest) == (len(commands), "")
    shown = "x[/red][bold]Gr\\xfcn:smile:\\udcff"
    for command, words in zip(commands, said, strict=True):
        assert shown in "".join(words.replace("|", "").split()), command


def test_a_campaign_in_an_odd_folder(tmp_path):
    folder = "x[/red] Grün :smile:"
    campaign = ("monte-carlo", "--controller", "nominal_di", "--runs", 2, "--out", folder)
    flown = ahv(*campaign, cwd=tmp_path, PYTHONIOENCODING="ascii")
    assert flown.returncode == 0, flown.stderr
    assert "x[/red] Gr\\xfcn :smile:" in flown.stdout
    assert ahv("faults", PYTHONIOENCODING="ascii").returncode == 0


def test_figures_are_never_overwritten(flown, tmp_path):
    _, out, _ = flown
    (tmp_path / "figure_3_2.svg").write_text("mine")
    result = told("figures", out / "bag", "--out", tmp_path)
    assert result.returncode == 2
    assert "figure_3_2.svg exists already: choose another --out" in result.stderr
    assert [file.read_text() for file in tmp_path.iterdir()] == ["mine"]


@pytest.fixture(scope="module", params=["graph", "library"])
def flown(request, tmp_path_factory):
    """Result of flying half a second and its folder."""
    out = tmp_path_factory.mktemp("flown") / request.param
    return (
        request.param,
        out,
        ahv(
            "fly",
            "nominal_di",
            "--engine",
            request.param,
            "--duration",
            0.5,
            "--out",
            out,
            "--json",
        ),
    )


def test_fly_as_json(flown):
    engine, out, result = flown
    assert result.returncode == 0, result.stderr
    summary = json.loads(result.stdout)
    assert json.loads((out / "summary.json").read_text()) == summary
    assert summary["case"] == "nominal_di"
    assert summary["engine"] == engine
    assert summary["steps"] == 50
    assert summary["success"] is True
    assert summary["bag"] == str(out / "bag") and (out / "bag" / "metadata.yaml").exists()
    assert tuple(summary["final_state"]) == State._fields
    assert summary["final_state"]["h"] == pytest.approx(24101, abs=1)
    assert summary["max_abs_alpha_deg"] < 3.7 and summary["max_abs_beta_deg"] < 1.3
    assert summary["wall_s"] > 0
    assert summary["real_time_factor"] == pytest.approx(0.5 / summary["wall_s"])


def test_figures_of_a_bag(flown, tmp_path):
    _, out, _ = flown
    result = ahv("figures", out / "bag", "--out", tmp_path, "--json")
    assert result.returncode == 0, result.stderr
    files = [Path(name) for name in json.loads(result.stdout)["figures"]]
    names = {f"figure_3_{number}.{kind}" for number in range(2, 8) for kind in ("png", "svg")}
    assert {file.name for file in files} == names
    for file in files:
        if file.suffix == ".png":
            with Image.open(file) as image:
                assert image.width > 800
                assert len(image.convert("L").getcolors()) > 20  # not an empty sheet
        else:
            assert "</svg>" in file.read_text()


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("trim", "--altitude", 1e5), ("altitude 100000 m", "0 to 47000 m")),
        (("trim", "--speed", 100), ("speed 100 m/s", "1191 to 7147 m/s")),
        (("trim", "--mass", "nan"), ("mass nan kg", "60000 to 140000 kg")),
        (("fly", "nope"), ("case 'nope'", "nominal_di")),
        (("fly", "nominal_di", "--duration", 0), ("duration", "0.01 to 3600 s")),
        (("fly", "nominal_di", "--engine", "warp"), ("--engine", "warp", "graph")),
        (("figures", "nothing", "--out", "x"), ("nothing is not a bag",)),
        (("trim", "--altitude", "high"), ("--altitude", "high")),
        (("fly", "n" * 300), ("name too long",)),
        (("fly", "nominal_di", "--namespace", "2nd car"), ("namespace /2nd car", "like /uav1")),
        (("fly", "nominal_di", "--namespace", "a", "--engine", "library"), ("--namespace",)),
    ],
)
def test_wrong_input_is_named(arguments, words, tmp_path):
    result = told(*arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    assert all(word in result.stderr for word in words), result.stderr
    assert list(tmp_path.iterdir()) == []  # nothing was begun


def test_a_file_where_a_folder_is_to_be_is_named():
    result = ahv("fly", "nominal_di", "--out", sys.executable)
    assert (result.returncode, result.stdout) == (2, "")
    assert sys.executable in result.stderr and "Traceback" not in result.stderr


def test_a_flight_is_never_overwritten(flown):
    _, out, _ = flown
    before = (out / "summary.json").read_bytes()
    result = ahv("fly", "nominal_di", "--duration", 0.1, "--out", out)
    assert result.returncode == 2
    assert f"{out / 'bag'} exists already" in result.stderr
    assert (out / "summary.json").read_bytes() == before


def test_a_flight_that_ends_early_says_so_by_its_exit_code(tmp_path):
    out = tmp_path / "lost"
    result = ahv("fly", "nominal_di_dispersed", "--engine", "library", "--out", out, "--json")
    assert result.returncode == 1
    summary = json.loads(result.stdout, parse_constant=lambda name: pytest.fail(name))
    assert summary["ended_early"] and summary["success"] is False
    assert summary["steps"] < 15000


def test_a_domain_that_ros_refuses_is_named(tmp_path):
    result = ahv("fly", "nominal_di", cwd=tmp_path, ROS_DOMAIN_ID="abc")
    assert result.returncode == 2
    assert result.stdout == "" and "ROS_DOMAIN_ID is 'abc'" in result.stderr


def test_the_library_engine_needs_no_ros(tmp_path):
    """The whole way of a flight and its figures without rclpy to import."""
    program = (
        "import sys; sys.modules['rclpy'] = None\n"
        "from ahv_analysis.command.app import app\n"
        f"out = {str(tmp_path)!r}\n"
        "fly = ['fly', 'neuro_adaptive_di', '--engine', 'library', '--duration', '0.5']\n"
        "app([*fly, '--out', out], standalone_mode=False)\n"
        "app(['figures', out + '/bag', '--out', out + '/figures'], standalone_mode=False)\n"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "figures" / "figure_4_1.png").exists()
