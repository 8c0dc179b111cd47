//! A package of its own, because cbindgen takes a minute to build: `cargo verify --all` runs its test.
