#!/usr/bin/env python3
"""campaign_ray.py on a local cluster of two nodes, one of which is killed in the middle: the same bytes as one machine.

    python3 tests/cluster/check_ray.py target/release/sitl

Needs PyPI `ray`. Exit status 0: the same.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ray.cluster_utils import Cluster

SCRIPT = Path(__file__).resolve().parents[2] / "gcs-scripts" / "campaign_ray.py"
FILES = ["runs.parquet", "summary.csv", "columns.csv", "campaign.toml", "report.html"]
SHARDS = 12
SPEC = """
name = "cluster"
duration_s = 40.0
scenario = "nominal"
samples = 300
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


def main():
    program = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        spec = folder / "spec" / "cluster.toml"
        spec.parent.mkdir()
        spec.write_text(SPEC)
        # The head gives no cores, so that every shard is on a node that can be killed.
        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
        nodes = [cluster.add_node(num_cpus=1), cluster.add_node(num_cpus=1)]
        command = [sys.executable, SCRIPT, spec, "--out", folder / "ray", "--program", program]
        command += ["--shards", str(SHARDS), "--address", cluster.address]
        flying = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        done = []
        for line in flying.stdout:
            print(line, end="", flush=True)
            done.append(line)
            if line.startswith("3 of"):
                # The other one is in the middle of a shard now.
                time.sleep(0.5)
                cluster.remove_node(nodes.pop(), allow_graceful=False)
                print("a node was killed", flush=True)
        assert flying.wait() == 0, "campaign_ray.py failed"
        cluster.shutdown()
        subprocess.run([program, "campaign", "run", spec, "--out", folder / "one"], check=True)
        for name in FILES:
            one, other = ((folder / where / name).read_bytes() for where in ["one", "ray/merged"])
            assert one == other, f"{name} differs"
            print(f"{name}: the same {len(one)} bytes")
        again = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
        assert "shards," not in again.stdout, "finished shards were flown again"
        assert not nodes[1:], "no node was killed"
    print("two nodes, one killed: the same bytes as one machine")


if __name__ == "__main__":
    main()
