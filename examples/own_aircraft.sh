#!/bin/sh
# Your aircraft, from a file to its first flights; here the Aerosonde with two kilograms of payload. docs/airframes.md has the keys.
#   cargo build --release && examples/own_aircraft.sh [FOLDER] [PROGRAM]
set -eu
folder=${1:-out/own_aircraft}
sitl=${2:-target/release/sitl}
mkdir -p "$folder"

# The file of the plant: mass and moments of inertia, aerodynamics, effectors, limits.
sed -e 's/^name = "aerosonde"/name = "payload"/' -e 's/^mass_kg = .*/mass_kg = 13.0/' \
  aircraft/aerosonde/airframe.toml >"$folder/airframe.toml"
aircraft="--airframe $folder/airframe.toml --model $folder/model.toml"

# What the controller knows, with its gains, speeds, radii and limits, checked by margins and flights: model.toml and report.md.
"$sitl" aircraft new --airframe "$folder/airframe.toml" --out "$folder"
# shellcheck disable=SC2086
{
  "$sitl" aircraft margins $aircraft --law lqr --compensator neso
  "$sitl" fly nominal $aircraft --set plant.duration_s=60 --out "$folder/healthy"
  # A jam of the right aileron at 5 degrees, after three seconds.
  "$sitl" fly nominal $aircraft --set plant.duration_s=60 --out "$folder/jammed" \
    --set plant.fault.1.effector=right_aileron --set plant.fault.1.kind=stuck_at \
    --set plant.fault.1.angle_deg=5 --set plant.fault.1.onset_s=3
}
