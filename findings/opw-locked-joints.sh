#!/bin/sh
# rs-opw-kinematics 3.0.0 (crates.io, closed kinematics of six-axis robots): a joint whose range has one angle, as that of a joint that is locked by its brake or mechanically, is not limited at all: Constraints::from_degrees() with
# 10.0..=10.0 for a joint lets every angle of it pass, compliant() and the inverse kinematics too, and a range that is a thousandth of a degree wide lets pass what it should. A caller that narrows a range step by step, to hold a
# joint, gets it released at the last step: solutions that turn it by any angle. The documentation has no such case. There is no error.
# Seen on 2026-11-30:  J1 in 10..=10: J1 at 10.0005, 50, 169 degrees compliant: true, true, true   10..=10.001: true, false, false   J1 of the solutions of a pose with J1 at 50: 50, 50, -130 (4 times), and none for the narrow range
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "locked"
version = "0.0.0"
edition = "2021"

[dependencies]
rs-opw-kinematics = { version = "=3.0.0", default-features = false }
TOML
cat > src/main.rs <<'RS'
use rs_opw_kinematics::constraints::{Constraints, BY_PREV};
use rs_opw_kinematics::kinematic_traits::Kinematics;
use rs_opw_kinematics::kinematics_impl::OPWKinematics;
use rs_opw_kinematics::parameters::opw_kinematics::Parameters;

fn first_in(to: f64) -> Constraints {
    let wide = || -170.0..=170.0;
    Constraints::from_degrees([10.0..=to, wide(), wide(), wide(), wide(), wide()], BY_PREV)
}

fn main() {
    let joints = |first: f64| [first, 10.0, 20.0, 30.0, 40.0, 50.0].map(f64::to_radians);
    let (locked, narrow) = (first_in(10.0), first_in(10.001));
    let passes = |limits: &Constraints| [10.0005, 50.0, 169.0].map(|first| limits.compliant(&joints(first)));
    let pose = OPWKinematics::new(Parameters::irb2400_10()).forward(&joints(50.0));
    let firsts = |limits| -> Vec<i32> {
        let robot = OPWKinematics::new_with_constraints(Parameters::irb2400_10(), limits);
        robot.inverse(&pose).iter().map(|solution| solution[0].to_degrees().round() as i32).collect()
    };
    let (loose, held) = (firsts(locked), firsts(narrow));
    println!("SEEN J1 at 10.0005, 50, 169 degrees compliant: 10..=10 {:?}, 10..=10.001 {:?}; J1 of the solutions: {loose:?}, {held:?}", passes(&locked), passes(&narrow));
    assert_eq!(passes(&locked), [true; 3]);
    assert_eq!(passes(&narrow), [true, false, false]);
    assert!(loose.contains(&50) && held.is_empty());
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
