# Both programs of the pair in one small image, the scripted ground station in another.
#   docker build --target flight  -t two-step/flight .
#   docker build --target station -t two-step/station .

FROM rust:1.95-slim-bookworm AS build
WORKDIR /build
ARG CARGO_BUILD_JOBS=default
COPY . .
RUN cargo build --release --locked -p autopilot -p plant-sim --bins \
 && strip target/release/autopilot target/release/plant-sim

FROM debian:bookworm-slim AS flight
COPY --from=build /build/target/release/autopilot /build/target/release/plant-sim /usr/local/bin/
COPY docker/healthy.sh /usr/local/bin/healthy
# The uid is fixed, so that volumes keep their owner. Logs and settings lie in the user's home.
RUN useradd --create-home --uid 10001 two-step \
 && install -d -o two-step -g two-step /home/two-step/.local/share/two-step
USER two-step
WORKDIR /home/two-step
VOLUME /home/two-step/.local/share/two-step
# Both programs write the file while all is well.
HEALTHCHECK --interval=2s --timeout=2s --start-period=10s --retries=3 CMD ["healthy"]
CMD ["autopilot", "--help"]

FROM python:3.12-slim-bookworm AS station
COPY gcs-scripts/requirements.txt /tmp/requirements.txt
RUN python3 -m venv /opt/station \
 && /opt/station/bin/pip install --no-cache-dir --disable-pip-version-check -r /tmp/requirements.txt
COPY gcs-scripts /opt/gcs-scripts
RUN useradd --create-home --uid 10001 two-step
USER two-step
WORKDIR /opt/gcs-scripts
ENV PATH=/opt/station/bin:$PATH PYTHONUNBUFFERED=1
CMD ["python3", "fly_case1.py", "--help"]
