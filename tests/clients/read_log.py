"""Reads a flight log with pyulog and checks it against the arguments of the test: path, control steps."""

import json
import sys

from pyulog import ULog

path, steps = sys.argv[1], int(sys.argv[2])
log = ULog(path)
assert not log.file_corruption, "pyulog finds the file damaged"
topics = {data.name: data.data for data in log.data_list}
for name in ["sensors", "commands", "control", "truth", "vehicle"]:
    assert len(topics[name]["timestamp"]) == steps, (name, len(topics[name]["timestamp"]))
assert (topics["truth"]["timestamp"] == topics["sensors"]["timestamp"]).all()
# Without noise the measured altitude is the true one.
assert (topics["truth"]["altitude_m"] == topics["sensors"]["altitude_m"]).all()
info = log.msg_info_dict
assert info["sys_name"] == "Two-Step" and info["control_steps"] == steps, info
assert json.loads(info["plant_header"])["setup"]["period"] == 2000
assert json.loads(info["control_header"])["session"] == info["session"]
assert log.initial_parameters["FTC_MODE"] == 1, log.initial_parameters
assert any("Flight began" in text.message for text in log.logged_messages)
print(f"pyulog reads {steps} steps, {len(log.initial_parameters)} parameters")
