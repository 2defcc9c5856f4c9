#!/usr/bin/env python3
"""The job array of docs/campaigns.md on a Slurm cluster of one node, with one task killed in the middle: the same bytes as
one machine.

    python3 tests/cluster/check_slurm.py target/release/sitl

Needs Debian's `slurm-wlm` and `munge`, and root. The daemons get their own files and ports and end with the script. Exit
status 0: the same.
"""

import contextlib
import os
import re
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs" / "campaigns.md"
FILES = ["runs.parquet", "summary.csv", "columns.csv", "campaign.toml", "report.html"]
SHARDS = 12
# The task that is killed when it has flown one part.
KILLED = 2
# Longest time for a task to begin, and for all to end, s.
BEGINS_S = 60
ENDS_S = 600
SPEC = """
name = "cluster"
duration_s = 40.0
scenario = "nominal"
samples = 1200
design = "sobol"

[set]
"plant.fault.1.kind" = "stuck_at"
"plant.fault.1.effector" = "rudder"
"plant.fault.1.onset_s" = 1.0

[[vary]]
key = "plant.fault.1.angle_deg"
uniform = [-20.0, 20.0]

[[law]]
name = "PID alone"
set = { FTC_MODE = 0 }

[[law]]
name = "paper"
set = { FTC_MODE = 1 }
"""
CONFIGURATION = """
ClusterName=check
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser=root
SlurmdUser=root
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/affinity
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
"""


def free_ports(count):
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(count)]
        return [one.getsockname()[1] for one in sockets]


@contextlib.contextmanager
def cluster(folder):
    """Munge, the controller and one node; gives the number of cores."""
    # Munge wants a socket that every user reaches and a key that no other user reads.
    folder.chmod(0o755)
    key = folder / "munge.key"
    key.write_bytes(secrets.token_bytes(128))
    key.chmod(0o600)
    for name in ["state", "spool"]:
        (folder / name).mkdir()
    cores = len(os.sched_getaffinity(0))
    host = socket.gethostname().split(".")[0]
    configuration = folder / "slurm.conf"
    configuration.write_text(
        CONFIGURATION.format(host=host, folder=folder, cores=cores, ports=free_ports(2))
    )
    os.environ["SLURM_CONF"] = str(configuration)
    files = [f"--{name}-file={folder}/munge.{name}" for name in ["key", "pid", "log", "seed"]]
    commands = [
        ["munged", "--foreground", f"--socket={folder}/munge.socket", *files],
        ["slurmctld", "-D"],
        ["slurmd", "-D", "-N", host],
    ]
    daemons = []
    try:
        for command in commands:
            log = (folder / f"{command[0]}.out").open("w")
            daemons.append(subprocess.Popen(command, stdout=log, stderr=log))
            time.sleep(1.0)
        until(lambda: "idle" in output("sinfo", "--noheader", "--format=%T"), "an idle node", BEGINS_S)
        yield cores
    except Exception:
        for log in folder.glob("*.out"):
            print(f"--- {log.name}", log.read_text()[-2000:], sep="\n", file=sys.stderr)
        raise
    finally:
        for daemon in reversed(daemons):
            daemon.terminate()
            daemon.wait(timeout=30)


def output(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.stdout


def until(holds, what, longest_s):
    end = time.monotonic() + longest_s
    while not holds():
        assert time.monotonic() < end, f"not within {longest_s} s: {what}"
        time.sleep(0.2)


def job_script(folder, spec, cores):
    """The script of the documentation, with the names and sizes of this check."""
    text = DOCS.read_text()
    block = re.search(r"### Slurm.*?```sh\n(.*?)```", text, re.DOTALL)
    assert block, f"{DOCS} has no script for Slurm"
    script = block[1]
    for old, new in [
        ("--array=1-64", f"--array=1-{SHARDS}"),
        ("--cpus-per-task=4\n", f"--cpus-per-task={cores}\n"),
        ("rudder.toml", str(spec)),
        ("--out results", f"--out {folder / 'results'}"),
        ("/64", f"/{SHARDS}"),
    ]:
        assert old in script, f"{DOCS}: the script has no {old}"
        script = script.replace(old, new)
    path = folder / "job.sh"
    path.write_text(script)
    return path


def submit(script, folder):
    text = output("sbatch", "--parsable", f"--output={folder}/task-%a.txt", str(script)).strip()
    assert text.isdigit(), f"sbatch: {text}"
    return text


def state(task):
    return output("squeue", "--noheader", "--format=%T", "--job", task).strip()


def ended(job):
    return not output("squeue", "--noheader", "--job", job).strip()


def parts(folder, shard=None):
    numbers = sorted(int(path.stem) for path in (folder / "results" / "parts").glob("*.part"))
    return [number for number in numbers if shard is None or number % SHARDS == shard - 1]


def main():
    program = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        bin_folder = folder / "bin"
        bin_folder.mkdir()
        shutil.copy(program, bin_folder / "sitl")
        os.environ["PATH"] = f"{bin_folder}:{os.environ['PATH']}"
        spec = folder / "cluster.toml"
        spec.write_text(SPEC)
        with cluster(folder) as cores:
            script = job_script(folder, spec, cores)
            job = submit(script, folder)
            until(lambda: parts(folder, KILLED), f"task {KILLED} has flown a part", BEGINS_S)
            assert state(f"{job}_{KILLED}") == "RUNNING", "the task was over before it could be killed"
            assert not output("scancel", "--signal=KILL", f"{job}_{KILLED}")
            until(lambda: ended(job), "the array", ENDS_S)
            first = parts(folder)
            missing = set(range(max(first) + 1)) - set(first)
            assert missing and all(number % SHARDS == KILLED - 1 for number in missing), missing
            print(f"task {KILLED} was killed: {len(first)} parts are there, {len(missing)} are missing")
            job = submit(script, folder)
            until(lambda: ended(job), "the array once more", ENDS_S)
            for task in range(1, SHARDS + 1):
                text = (folder / f"task-{task}.txt").read_text()
                assert f"shard {task}/{SHARDS}" in text, f"task {task}: {text}"
            assert not set(range(max(first) + 1)) - set(parts(folder)), "parts are still missing"
        results = folder / "results"
        for out in [results, folder / "one"]:
            command = ["sitl", "campaign", "run", spec, "--out", out]
            subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        for name in FILES:
            one, other = ((folder / where / name).read_bytes() for where in ["one", "results"])
            assert one == other, f"{name} differs"
            print(f"{name}: the same {len(one)} bytes")
    print(f"an array of {SHARDS} tasks, one killed: the same bytes as one machine")


if __name__ == "__main__":
    main()
