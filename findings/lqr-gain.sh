#!/bin/sh
# lqr 0.1.0, nalgebra 0.30.1 (crates.io, linear quadratic regulator, "real-world tested with cars and quadcopters"): compute_gain(), "computes and returns the optimal gain matrix K", solves the Riccati equation of discrete time and takes the formula
# of continuous time for the gain, R^-1 B' P, so that it is right for neither. For continuous matrices, as those of the README's car, a mass that should be held at a place (position' = velocity, velocity' = force, all weights 1) gets the gains 0 and 2,
# where 1 and 1.73 are optimal: its position is not controlled at all, and a pole is at 0; it stays wherever it comes to rest. For discrete ones, where (R + B' P B)^-1 B' P A belongs to that P, the gain is too large, and the more so the cheaper the
# control: x' = x + u with weights 1 and 0.1 gets 10.9 instead of 0.92, and an error of 1 is 98 after two steps. There is no error; with an expensive control (weight 100) it is 0.105 for 0.095, and a simulation looks right.
# And find_closest_indices(), which should give the point of a path behind the robot and the one in front, gives the pair on the other side of the nearest point: at x = 1.9 of points at 0, 1, 2, 3, 4 it gives 2 and 3, at 2.1 it gives 1 and 2.
# Seen on 2026-12-01:  mass, continuous: gain 0.000 2.000   x' = x + u, weights 1, 0.1: 10.916, right 0.916, after two steps 98.33   weight 100: 0.105, right 0.095   x = 1.9: 2 and 3, 2.1: 1 and 2
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "gain"
version = "0.0.0"
edition = "2021"

[dependencies]
lqr = "=0.1.0"
nalgebra = "=0.30.1"
TOML
cat > src/main.rs <<'RS'
use lqr::{find_closest_indices, LQRController};
use nalgebra::{Const, Matrix1, Matrix1x2, Matrix2, SMatrix, SVector, Vector2};

fn main() {
    // Continuous: the optimal gain of a mass with all weights 1 is 1 and the root of 3.
    let (a, b) = (Matrix2::new(0.0, 1.0, 0.0, 0.0), Vector2::new(0.0, 1.0));
    let mut mass = LQRController::<f64, Const<2>, Const<1>>::new().unwrap();
    let gain = mass.compute_gain(&a, &b, &Matrix2::identity(), &Matrix1::new(1.0), 1e-9).unwrap();
    let optimal = Matrix1x2::new(1.0, 3f64.sqrt());
    println!("SEEN mass, continuous: gain {:.3} {:.3}, optimal {:.3} {:.3}", gain[0], gain[1], optimal[0], optimal[1]);
    assert!(gain[0].abs() < 1e-6 && (gain[1] - 2.0).abs() < 1e-6);
    // At rest and far from its goal, no force brings it back.
    let force = mass.compute_optimal_controls(&Vector2::new(10.0, 0.0), &Vector2::new(0.0, 0.0)).unwrap();
    println!("SEEN mass at rest, 10 m away from its goal: force {:.3}", force[0]);
    assert!(force[0].abs() < 1e-5);

    // Discrete: x' = x + u, the optimal gain by iterating the cost backward.
    let one = Matrix1::new(1.0);
    for (r, seen, best) in [(0.1, 10.916, 0.916), (100.0, 0.105, 0.095)] {
        let mut joint = LQRController::<f64, Const<1>, Const<1>>::new().unwrap();
        let gain = joint.compute_gain(&one, &one, &one, &Matrix1::new(r), 1e-9).unwrap()[0];
        let (mut cost, mut right) = (1.0, 0.0);
        for _ in 0..10_000 {
            right = cost / (r + cost);
            cost = 1.0 + cost * (1.0 - right);
        }
        println!("SEEN x' = x + u, weights 1 and {r}: gain {gain:.3}, right {right:.3}, an error of 1 after two steps: {:.2}", (1.0 - gain).powi(2));
        assert!((gain - seen).abs() < 1e-3 && (right - best).abs() < 1e-3);
    }

    let path = SMatrix::<f64, 2, 5>::from_fn(|row, column| if row == 0 { column as f64 } else { 0.0 });
    for (x, pair) in [(1.9, (2, 3)), (2.1, (1, 2))] {
        let (behind, front) = find_closest_indices(&SVector::<f64, 2>::new(x, 0.0), &path).ok().unwrap();
        println!("SEEN path 0, 1, 2, 3, 4, robot at {x}: points {} and {}", behind.0, front.0);
        assert_eq!((behind.0, front.0), pair);
    }
}
RS
CARGO_BUILD_JOBS=1 cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
