"""Vehicles for tests: the fixture `two_step_vehicle`.

pytest loads this module wherever the package is installed; what a vehicle needs is imported by the first test that flies one.
"""

import shutil
from pathlib import Path

import pytest

FAILED = pytest.StashKey[bool]()
VEHICLES = pytest.StashKey[list]()


def pytest_addoption(parser):
    about = "Folder for the logs of flights of failed tests [default: one of pytest's temporary folders]"
    parser.getgroup("two_step").addoption("--two-step-logs", metavar="DIR", help=about)
    parser.addini("two_step_logs", about, default="")


@pytest.fixture
def two_step_vehicle(request, tmp_path_factory):
    """Starts vehicles, as ``two_step.Vehicle(...)``, and ends them after the test. Their logs stay where it fails."""
    from two_step.vehicle import Vehicle

    kept = request.config.getoption("two_step_logs") or request.config.getini("two_step_logs")
    name = "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in request.node.name)[:80]
    base = (request.config.rootpath / kept).resolve() if kept else tmp_path_factory.getbasetemp()
    vehicles = request.node.stash[VEHICLES] = []
    request.node.stash[FAILED] = False
    folders = []

    def start(*arguments, **options):
        if "log_dir" not in options:
            options["log_dir"] = _new_folder(base, name)
            folders.append(options["log_dir"])
        vehicle = Vehicle(*arguments, **options)
        vehicles.append(vehicle)
        return vehicle

    yield start
    for vehicle in vehicles:
        vehicle.close()
    if not request.node.stash[FAILED]:
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)


def _new_folder(base, name):
    base.mkdir(parents=True, exist_ok=True)
    for number in range(10_000):
        folder = Path(base, f"{name}-{number}")
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        return folder
    raise FileExistsError(f"{base} has 10000 folders of {name}")


# Of the old kind, which every version of pytest takes.
@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item):
    report = (yield).get_result()
    if report.failed:
        item.stash[FAILED] = True
        for number, vehicle in enumerate(item.stash.get(VEHICLES, [])):
            report.sections.append((f"two_step vehicle {number}", vehicle.report()))
