"""Commands as functions, and the program itself."""

import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

import two_step


def test_a_campaign_gives_the_tables_of_the_command_line(sitl, out):
    sitl("campaign", "run", "smoke", "--samples", "1", "--out", out)
    result = two_step.campaign.run("smoke", samples=1)
    theirs = two_step.Table.read(out / "runs.parquet")
    assert result.status == 0 and result["runs"].names == theirs.names
    for name in theirs.names:
        assert list(map(str, result["runs"][name])) == list(map(str, theirs[name])), name
    assert "survived" in result.text or "lost" in result.text


def test_a_campaign_goes_on_where_it_was(out):
    first = two_step.campaign.run("smoke", samples=1, out=out)
    again = two_step.campaign.run("smoke", samples=1, out=out)
    assert len(again["runs"]) == len(first["runs"])


def test_a_log_is_read_and_flown_again(sitl, out):
    sitl("fly", "case1", "--set", "plant.duration_s=4", "--out", out, "--ulog")
    log = two_step.read_log(out / "flight.ulg")
    assert log.infos["run_hash"] and len(log["truth"]) > 50
    assert log["truth"]["altitude_m"][0] == pytest.approx(5000, abs=1)
    assert two_step.replay(out / "flight.ulg") is True
    (out / "x.ulg").write_bytes(b"no log")
    with pytest.raises(ValueError):
        two_step.read_log(out / "x.ulg")
    with pytest.raises(ValueError, match="cannot be flown again"):
        two_step.replay(out / "x.ulg")


def test_models_gains_and_limits_of_an_aircraft():
    model = two_step.linearize(airframe="f16")
    assert model["aircraft"] == "f16" and model["mass"]["mass_kg"] > 1000
    assert any(name.startswith("LQR_") for name in two_step.design_lqr())
    model, report = two_step.new_aircraft(airframe="aerosonde_vtail")
    assert model["parameters"]["GND_STEER"] == 2.9 and report.startswith("# aerosonde_vtail")
    limits = two_step.trimmable(step_deg=15)
    assert limits.tables and "left_elevator" in str(limits[sorted(limits.tables)[0]].to_dict())


def test_a_wheel_writes_an_fmu(tmp_path):
    library = Path(sysconfig.get_path("data")) / "lib" / "libtwo_step_fmu.so"
    if not library.is_file():
        pytest.skip("no wheel with the library of FMUs is installed")
    two_step.fmu(tmp_path / "f16.fmu", airframe="f16")
    with zipfile.ZipFile(tmp_path / "f16.fmu") as fmu:
        assert "modelDescription.xml" in fmu.namelist()
        assert any(fmu.read(name) == library.read_bytes() for name in fmu.namelist())


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: two_step.trimmable(step_deg=0), ValueError, "0.05 to 90"),
        (lambda: two_step.trimmable(step=1), TypeError, "--step"),
        (lambda: two_step.campaign.run("zz"), ValueError, "the campaigns that come with the program are"),
        (lambda: two_step.campaign.run("smoke", samples=0), ValueError, "0"),
        (lambda: two_step.study("zz"), ValueError, "zz"),
        (lambda: two_step.study("jam-table", nothing=1), (TypeError, ValueError), "--nothing"),
        (lambda: two_step.margins(law="zz"), ValueError, "there is no law zz"),
    ],
)
def test_mistakes_are_exceptions(call, error, words):
    with pytest.raises(error) as refused:
        call()
    assert words in str(refused.value)


def test_the_program_is_there(sitl):
    program = [sys.executable, "-m", "two_step"]
    help_of = subprocess.run([*program, "--help"], capture_output=True, text=True)
    assert help_of.returncode == 0 and help_of.stdout == sitl("--help")
    refused = subprocess.run([*program, "fly", "case9"], capture_output=True, text=True)
    assert refused.returncode == 2 and "case9" in refused.stderr
    flown = subprocess.run([*program, "fly", "case1", "--set", "plant.duration_s=3"], capture_output=True, text=True)
    assert flown.returncode == 0 and flown.stdout.startswith("case1, seed 1: kept")
