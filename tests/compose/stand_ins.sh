#!/bin/sh
# Base images of the Dockerfile for a machine that can reach Debian's mirror and crates.io but no container
# registry: Debian's packages and the installed Rust toolchain under the names of the real images.
# Needs root, debootstrap and a Docker engine. Images that are there already are left alone.
set -eu

have() { docker image inspect "$1" >/dev/null 2>&1; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if ! have debian:bookworm-slim; then
  if ! command -v debootstrap >/dev/null; then
    apt-get update -q >/dev/null && apt-get install -q -y debootstrap >/dev/null
  fi
  echo "stand-in for debian:bookworm-slim"
  packages=ca-certificates,gcc,libc6-dev,python3,python3-venv
  debootstrap --variant=minbase --include="$packages" bookworm "$work/root" http://deb.debian.org/debian \
    >"$work/log" 2>&1 || { tail -n 20 "$work/log" >&2; exit 1; }
  # This machine may reach the registries only through its own certificates.
  cp -L /etc/ssl/certs/ca-certificates.crt "$work/root/etc/ssl/certs/ca-certificates.crt"
  rm -rf "$work/root/var/cache/apt/archives" "$work/root/var/lib/apt/lists"
  tar -C "$work/root" -c . | docker import \
    --change "ENV PIP_CERT=/etc/ssl/certs/ca-certificates.crt" \
    --change "ENV SSL_CERT_FILE=/etc/ssl/certs/ca-certificates.crt" \
    - debian:bookworm-slim >/dev/null
  rm -rf "$work/root"
fi

if ! have python:3.12-slim-bookworm; then
  echo "stand-in for python:3.12-slim-bookworm (Debian's Python)"
  docker tag debian:bookworm-slim python:3.12-slim-bookworm
fi

if ! have rust:1.95-slim-bookworm; then
  echo "stand-in for rust:1.95-slim-bookworm"
  toolchain=$(rustc --print sysroot)
  mkdir "$work/rust"
  for part in bin lib libexec; do
    if [ -d "$toolchain/$part" ]; then cp -aL "$toolchain/$part" "$work/rust/"; fi
  done
  cat >"$work/Dockerfile" <<'END'
FROM debian:bookworm-slim
COPY rust /usr/local
ENV CARGO_HOME=/usr/local/cargo CARGO_HTTP_CAINFO=/etc/ssl/certs/ca-certificates.crt
END
  DOCKER_BUILDKIT=0 docker build --quiet -t rust:1.95-slim-bookworm "$work" >/dev/null
fi
