#!/bin/sh
# k 0.32.0 (crates.io, kinematics of openrr): create_reference_positions_nullspace_function(), which keeps a redundant arm near reference positions with the motion that its target leaves free, drives it away from them with the positive weights
# of the documentation's example: it gives the gradient of the distance, dH/dq = W (q - q^) by its comment, and the solver adds it, where a step down needs it subtracted. While the hand moves by 5 mm to and fro, the
# joints leave the reference until they stand at their limits or have turned over. With negative weights they come to it. All calls return Ok and the hand is where it should be.
# Seen on 2026-11-30:  distance of four joints from the reference, 200 solutions: weights 0.1: 0.61 -> 1.73 rad   without: 0.61 -> 0.61   weights -0.1: 0.61 -> 0.13
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "reference"
version = "0.0.0"
edition = "2021"

[dependencies]
k = { version = "=0.32.0", default-features = false }
TOML
cat > src/main.rs <<'RS'
use k::{prelude::*, Constraints, JacobianIkSolver, JointType, Node, NodeBuilder, SerialChain, Translation3, Vector3};

/// A planar arm of four joints about z with links of 0.3 m.
fn arm() -> SerialChain<f64> {
    let node = |place: usize| -> Node<f64> {
        let joint = if place == 4 { JointType::Fixed } else { JointType::Rotational { axis: Vector3::z_axis() } };
        let offset = Translation3::new(if place == 0 { 0.0 } else { 0.3 }, 0.0, 0.0);
        NodeBuilder::new().name(&format!("j{place}")).translation(offset).joint_type(joint).into_node()
    };
    let nodes: Vec<Node<f64>> = (0..5).map(node).collect();
    for pair in nodes.windows(2) {
        pair[1].set_parent(&pair[0]);
    }
    SerialChain::from_end(&nodes[4])
}

/// The distance of the joints from the reference before and after 200 solutions for a hand that moves by 5 mm.
fn distances(weight: Option<f64>) -> (f64, f64) {
    let reference = vec![0.4, 0.0, 0.4, 0.4];
    let arm = arm();
    arm.set_joint_positions(&[0.6, -0.4, 0.8, 0.3]).unwrap();
    let distance = |arm: &SerialChain<f64>| arm.joint_positions().iter().zip(&reference).map(|(q, r)| (q - r).powi(2)).sum::<f64>().sqrt();
    let before = distance(&arm);
    let mut solver = JacobianIkSolver::new(0.001, 0.005, 0.5, 100);
    if let Some(weight) = weight {
        solver.set_nullspace_function(Box::new(k::create_reference_positions_nullspace_function(reference.clone(), vec![weight; 4])));
    }
    let constraints = Constraints { position_z: false, rotation_x: false, rotation_y: false, rotation_z: false, ..Default::default() };
    let home = arm.end_transform();
    for step in 0..200 {
        let mut target = home;
        target.translation.vector[0] += if step % 2 == 0 { 0.005 } else { 0.0 };
        solver.solve_with_constraints(&arm, &target, &constraints).unwrap();
        assert!((arm.end_transform().translation.vector - target.translation.vector).norm() < 0.0011);
    }
    (before, distance(&arm))
}

fn main() {
    let (positive, none, negative) = (distances(Some(0.1)), distances(None), distances(Some(-0.1)));
    println!("SEEN distance from the reference, before and after (rad): weights 0.1 {positive:.2?}, none {none:.2?}, -0.1 {negative:.2?}");
    assert!(positive.1 > 2.0 * positive.0 && (none.1 - none.0).abs() < 0.05 && negative.1 < 0.5 * negative.0);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
