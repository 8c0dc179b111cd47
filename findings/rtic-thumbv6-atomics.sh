#!/bin/sh
# rtic 2.4.0 (crates.io): the feature thumbv6-backend, for Cortex-M0 and M0+, does not build by itself. Its executor compares and exchanges portable-atomic's AtomicBool, for which
# this core has no instruction, and the feature does not select portable-atomic's critical-section: the application has to depend on portable-atomic only to set a feature of a
# dependency of rtic. The other backends of Cortex-M need nothing.
# Seen on 2026-11-29:  alone: compare_exchange requires atomic CAS but not available on this target   with portable-atomic's critical-section: builds   thumbv7-backend alone: builds
# It needs cargo with the targets thumbv6m-none-eabi and thumbv7m-none-eabi.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src
echo '#![no_std]' > src/lib.rs
# Checks a library that depends on rtic with this backend, and on more.
check() {
  printf '[package]\nname = "app"\nversion = "0.0.0"\nedition = "2021"\n[dependencies]\nrtic = { version = "=2.4.0", features = ["%s-backend"] }\n%s\n' "$1" "$3" > Cargo.toml
  cargo check --quiet --target "$2" 2> errors
}
if check thumbv6 thumbv6m-none-eabi ""; then echo "thumbv6-backend builds alone: the behaviour changed"; exit 1; fi
grep -m 1 "compare_exchange. requires atomic CAS but not available on this target" errors
check thumbv6 thumbv6m-none-eabi 'portable-atomic = { version = "=1.15.0", default-features = false, features = ["critical-section"] }'
echo "with portable-atomic's critical-section: builds"
check thumbv7 thumbv7m-none-eabi ""
echo "thumbv7-backend alone: builds"
