#!/bin/sh
# ufmt_float 0.2.0, ufmt 0.2.0 (crates.io): the decimals of every negative number are printed as zeros, and numbers between -1 and 0 lose their sign with them: -1.25 is -1.00, and -0.5 is 0.00. The rest of a
# negative number is converted to an unsigned integer, which ends at 0. f32, f64 and the feature maths do the same; there is no error. A log of torques or positions of a microcontroller, from which a
# data set or a comparison with the simulation is made, has whole numbers on one side of zero and decimals on the other.
# Seen on 2026-11-29:  1.25 0.5 0.05: 1.25 0.50 0.05   -1.25 -0.5 -0.05: -1.00 0.00 0.00 (f32, f64, with and without maths)
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "log"
version = "0.0.0"
edition = "2024"

[features]
default = ["maths"]
maths = ["ufmt_float/maths"]

[dependencies]
ufmt = "=0.2.0"
ufmt_float = { version = "=0.2.0", default-features = false }
TOML
cat > src/main.rs <<'RS'
use ufmt_float::{uFmt_f32, uFmt_f64};

struct Line(String);

impl ufmt::uWrite for Line {
    type Error = std::convert::Infallible;
    fn write_str(&mut self, text: &str) -> Result<(), Self::Error> {
        self.0.push_str(text);
        Ok(())
    }
}

fn main() {
    for (value, expected) in [(1.25, "1.25"), (0.5, "0.50"), (0.05, "0.05"), (-1.25, "-1.00"), (-0.5, "0.00"), (-0.05, "0.00")] {
        let (mut single, mut double) = (Line(String::new()), Line(String::new()));
        ufmt::uwrite!(&mut single, "{}", uFmt_f32::Two(value as f32)).unwrap();
        ufmt::uwrite!(&mut double, "{}", uFmt_f64::Two(value)).unwrap();
        println!("{value}: f32 {}, f64 {}", single.0, double.0);
        assert_eq!([single.0.as_str(), double.0.as_str()], [expected; 2]);
    }
}
RS
cargo run -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
cargo run -q --no-default-features 2>err.txt || { tail -n 20 err.txt; exit 1; }
