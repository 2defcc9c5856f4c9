#!/usr/bin/env python3
"""Flies a campaign on a Ray cluster: shards as tasks, merged to the bytes that one machine writes.

    python3 gcs-scripts/campaign_ray.py SPEC --out DIR --program target/release/sitl --shards 32 [--address auto]

The program and the folder of the specification travel with the tasks, so the nodes need Ray (PyPI `ray`) and nothing else of
this project. A shard whose node dies is flown again on another one. What has come back lies in DIR/shards; the script can be
killed and started again with the same options, and flies only what is missing.

Exit status: 0 merged, 1 a shard or the merge failed, 2 wrong arguments or no Ray.
"""

import argparse
import io
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path

# The first failure ends the script with its text; those of the other tasks would bury it.
os.environ["RAY_IGNORE_UNHANDLED_ERRORS"] = "1"

try:
    import ray  # noqa: E402
except ImportError:
    ray = None

# Largest folder of a specification that is sent, bytes: a few files of aircraft, models and gains.
FOLDER_MAX = 32 * 1024 * 1024
# A shard is tried so often in all, when Ray reports an error; for a node that dies Ray itself tries again.
TRIES = 3


class ShardFailed(Exception):
    """The program refused or ended badly; the text is its own."""


def pack(folder):
    """A folder as the bytes of a tar archive, its files in the order of their names."""
    data = io.BytesIO()
    with tarfile.open(fileobj=data, mode="w") as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                archive.add(path, arcname=str(path.relative_to(folder)))
    return data.getvalue()


def unpack(data, folder):
    """Writes the files of an archive of `pack` into a folder."""
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        archive.extractall(folder, filter="data")


def fly_shard(program, files, spec, number, count, threads):
    """Flies one shard in a temporary folder of the node; returns the folder with its parts as an archive."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        binary = folder / "sitl"
        binary.write_bytes(program)
        binary.chmod(0o755)
        if files is not None:
            unpack(files, folder / "spec")
            spec = str(folder / "spec" / spec)
        out = folder / "out"
        command = [binary, "campaign", "run", spec, "--out", out, "--shard", f"{number}/{count}"]
        environment = {**os.environ, "RAYON_NUM_THREADS": str(threads)}
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        if done.returncode != 0:
            raise ShardFailed(f"shard {number}/{count}: {done.stderr.strip() or done.returncode}")
        return pack(out)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("spec", help="a campaign that comes with the program, or a file")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--program", type=Path, required=True, help="the program sitl")
    parser.add_argument("--shards", type=int, required=True, help="number of tasks, several times that of the cores")
    parser.add_argument("--threads", type=int, default=1, help="cores of a task (default 1)")
    parser.add_argument("--address", help="of the cluster; without it Ray starts one on this machine")
    args = parser.parse_args()
    if not 1 <= args.shards <= 100_000:
        parser.error(f"--shards {args.shards}: expected 1 to 100000")
    if not 1 <= args.threads <= 1024:
        parser.error(f"--threads {args.threads}: expected 1 to 1024")
    if not args.program.is_file():
        parser.error(f"--program {args.program}: there is no such file")
    if ray is None:
        parser.error(f"this needs Ray: {sys.executable} -m pip install ray")
    return args


def specification(spec):
    """The folder of a specification as an archive and its name in there; a campaign of the program needs neither."""
    path = Path(spec)
    if not path.is_file():
        return None, spec
    size = sum(file.stat().st_size for file in path.parent.rglob("*") if file.is_file())
    if size > FOLDER_MAX:
        raise ShardFailed(
            f"{path.parent}: {size} bytes are sent to every node with the specification, at most {FOLDER_MAX} may be: "
            "move it into a folder with its own files only"
        )
    return pack(path.parent.resolve()), path.name


def fly(args):
    """Flies every shard that is missing; returns the folders of all of them."""
    shards = args.out / "shards"
    shards.mkdir(parents=True, exist_ok=True)
    folders = {k: shards / f"{k}-of-{args.shards}" for k in range(1, args.shards + 1)}
    missing = [k for k, folder in folders.items() if not folder.is_dir()]
    files, spec = specification(args.spec)
    if missing:
        try:
            ray.init(address=args.address, log_to_driver=False, include_dashboard=False)
        except Exception as error:  # Ray has no common type for them.
            raise ShardFailed(f"--address {args.address}: Ray does not start: {error}") from error
        task = ray.remote(num_cpus=args.threads, max_retries=-1)(fly_shard)
        program = ray.put(args.program.read_bytes())
        files = ray.put(files)
        tries = dict.fromkeys(missing, 0)

        def start(number):
            tries[number] += 1
            return task.remote(program, files, spec, number, args.shards, args.threads)

        running = {start(number): number for number in missing}
        begun = time.monotonic()
        done = 0
        while running:
            [ready], _ = ray.wait(list(running), num_returns=1)
            number = running.pop(ready)
            try:
                data = ray.get(ready)
            except ray.exceptions.RayError as error:
                cause = getattr(error, "cause", None) or error
                # What the program refuses it refuses on every node.
                if isinstance(cause, ShardFailed) or tries[number] >= TRIES:
                    raise ShardFailed(str(cause)) from error
                running[start(number)] = number
                continue
            # Whole or not there: a folder gets its name last.
            beside = Path(tempfile.mkdtemp(prefix="new-", dir=shards))
            unpack(data, beside)
            beside.rename(folders[number])
            done += 1
            elapsed = time.monotonic() - begun
            left = elapsed / done * (len(missing) - done)
            print(f"{done} of {len(missing)} shards, {done / elapsed:.2f}/s, {left:.0f} s left", flush=True)
    return [str(folder) for folder in folders.values()]


def main():
    args = arguments()
    try:
        folders = fly(args)
    except (ShardFailed, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    finally:
        for beside in (args.out / "shards").glob("new-*"):
            shutil.rmtree(beside, ignore_errors=True)
    merged = args.out / "merged"
    try:
        done = subprocess.run([args.program, "campaign", "merge", args.spec, "--out", merged, *folders])
    except OSError as error:
        print(error, file=sys.stderr)
        return 1
    return 0 if done.returncode == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
