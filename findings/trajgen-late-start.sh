#!/bin/sh
# trajgen 0.1.1 (crates.io, trajectories of least acceleration, jerk or snap through waypoints): a trajectory that does not start at the time 0 misses
# its waypoints. The polynomials are in the absolute time, up to its seventh power, and solved in f32: one of least snap through 1, 2, 0 m that starts
# at 5 s is up to 6.5 m off at its own waypoints, and at 10 s up to 1,472 m; one of least jerk is up to 0.6 m off at 10 s. At 0 s they are right to
# 0.25 mm. The README starts at 0 and says nothing of it. The misses come without an error.
# Seen on 2026-12-01:  snap, greatest miss of 3 waypoints: start 0: 0.0002   1: 0.005   5: 6.5   10: 1472   jerk: 0.00001, 0.0001, 0.04, 0.6
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "late"
version = "0.0.0"
edition = "2021"

[dependencies]
trajgen = "=0.1.1"
TOML
cat > src/main.rs <<'RS'
use trajgen::{Point, TrajectoryGenerator, TrajectoryType};

/// The greatest miss in x at the trajectory's own waypoints, of which there is one each second.
fn miss(kind: TrajectoryType, start: f32) -> f32 {
    let places = [1.0, 2.0, 0.0].into_iter().zip(0u8..);
    let points: Vec<Point> = places.map(|(x, at)| Point::new(x, 0.0, 0.0, start + f32::from(at))).collect();
    let mut generator = TrajectoryGenerator::new(kind);
    generator.generate(&points);
    points.iter().map(|point| (generator.get_position(point.t).unwrap().x - point.x).abs()).fold(0.0, f32::max)
}

fn main() {
    use TrajectoryType::{Jerk, Snap};
    let starts = [0.0, 1.0, 5.0, 10.0];
    let snap = starts.map(|start| miss(Snap, start));
    let jerk = starts.map(|start| miss(Jerk, start));
    println!("SEEN greatest miss at the 3 waypoints, start at 0, 1, 5, 10 s: snap {snap:?}, jerk {jerk:?}");
    assert!(snap[0] < 1e-3 && snap[1] < 0.02 && snap[2] > 1.0 && snap[3] > 100.0);
    assert!(jerk[0] < 1e-4 && jerk[2] > 0.01 && jerk[3] > 0.2);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
