#!/bin/sh
# docker-compose.yml on a real engine: case 1 flown by three hosts, a host disconnected and reconnected, hosts
# restarted. Without an engine it reports that and succeeds. With `build` it only builds the images.
set -eu
only=${1:-}
cd "$(dirname "$0")/../.."

if ! timeout 20 docker version --format '{{.Server.Version}}' >/dev/null 2>&1; then
  echo "SKIPPED: no Docker engine answers, so docker-compose.yml was not run"
  exit 0
fi
if docker compose version >/dev/null 2>&1; then
  compose() { docker compose -p two-step-test "$@"; }
elif command -v docker-compose >/dev/null; then
  compose() { docker-compose -p two-step-test "$@"; }
else
  echo "SKIPPED: there is a Docker engine and no Compose, so docker-compose.yml was not run"
  exit 0
fi

trouble() {
  echo "FAILED: $1" >&2
  compose logs --no-color --tail 40 >&2 || true
  exit 1
}

for image in rust:1.95-slim-bookworm debian:bookworm-slim python:3.12-slim-bookworm; do
  if ! docker image inspect "$image" >/dev/null 2>&1 && ! timeout 120 docker pull --quiet "$image"; then
    echo "no registry answers: stand-ins for the base images"
    tests/compose/stand_ins.sh
    break
  fi
done

log=$(mktemp)
trap 'rm -f "$log"; compose down --volumes --timeout 5 >/dev/null 2>&1' EXIT
compose down --volumes >/dev/null 2>&1 || true
echo "building ..."
# One crate at a time, because this may run beside tests.
set -- --build-arg CARGO_BUILD_JOBS=1
compose build --quiet "$@" autopilot station 2>/dev/null || compose build "$@" autopilot station

if [ "$only" = build ]; then exit 0; fi

fly_case_1() {
  code=0
  TWO_STEP_FTC=$1 TWO_STEP_SPEED=10 compose up --exit-code-from station --timeout 5 >"$log" 2>&1 || code=$?
  if [ "$code" != "$2" ]; then
    cat "$log" >&2
    trouble "case 1 with the compensator $1: exit status $code, not $2"
  fi
  grep -q "the aircraft $3" "$log" || { cat "$log" >&2; trouble "the station does not report $3"; }
  echo "case 1 with the compensator $1: $3, exit status $code, as it should be"
  compose down --volumes >/dev/null 2>&1
}
fly_case_1 armed 0 SURVIVED
fly_case_1 off 1 "was LOST"

# Output of a container.
output() { docker logs "$1" 2>&1; }
# Waits for a number of lines with a text.
wait_for() {
  for _ in $(seq 150); do
    if [ "$(output "$1" | grep -c "$2")" -ge "$3" ]; then return; fi
    sleep 0.2
  done
  trouble "$1 did not print '$2' $3 times"
}
wait_until() {
  for _ in $(seq 150); do
    if [ "$(docker inspect --format '{{.State.Health.Status}}' "$1")" = "$2" ]; then return; fi
    sleep 0.2
  done
  trouble "$1 is not $2"
}

compose up -d autopilot plant-sim >/dev/null 2>&1
autopilot=$(compose ps -q autopilot)
plant=$(compose ps -q plant-sim)
network=$(docker inspect --format '{{range $name, $_ := .NetworkSettings.Networks}}{{$name}}{{end}}' "$plant")
wait_until "$autopilot" healthy
wait_until "$plant" healthy
wait_for "$autopilot" "a flight begins" 1
user=$(docker exec "$autopilot" id -u)
[ "$user" != 0 ] || trouble "the autopilot runs as root"
echo "the pair flies, both healthy, as user $user"

docker network disconnect "$network" "$plant"
wait_for "$autopilot" "the plant does not answer any more" 1
wait_until "$plant" unhealthy
docker network connect --ip 172.29.66.3 "$network" "$plant"
wait_for "$autopilot" "the plant is back" 1
wait_until "$plant" healthy
[ "$(output "$autopilot" | grep -c "a flight begins")" = 1 ] || trouble "being cut off began a new flight"
echo "the plant was cut off and came back: the same flight goes on"

docker restart --time 5 "$plant" >/dev/null
wait_for "$autopilot" "a flight begins" 2
wait_until "$plant" healthy
echo "the plant was restarted: a new flight"

docker restart --time 5 "$autopilot" >/dev/null
wait_for "$autopilot" "joined_in_flight=true" 1
wait_until "$plant" healthy
[ "$(output "$plant" | grep -c "the flight begins")" = 2 ] || trouble "the plant began a new flight"
echo "the autopilot was restarted: it joined the flight in progress"

docker network disconnect "$network" "$autopilot"
wait_until "$plant" unhealthy
docker network connect --ip 172.29.66.2 "$network" "$autopilot"
wait_until "$plant" healthy
echo "the autopilot was cut off and came back: the plant goes on"

code=0
compose --profile live up -d live live-plant >/dev/null 2>&1 || code=$?
if [ "$code" = 0 ]; then
  live=$(compose --profile live ps -q live-plant)
  wait_until "$live" healthy
  python3 - <<'END' || trouble "no MAVLink on the port of this machine"
import socket
link = socket.create_connection(("127.0.0.1", 5760), timeout=10)
link.settimeout(10)
assert link.recv(1) == b"\xfd", "no MAVLink 2 frame"
END
  echo "the profile live: MAVLink at 127.0.0.1:5760 of this machine"
  compose --profile live down --volumes --timeout 5 >/dev/null 2>&1
else
  echo "the profile live was not tried: port 5760 or 18570 of this machine is taken"
fi
echo "docker-compose.yml holds what it says"
