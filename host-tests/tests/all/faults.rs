//! The executor with numbers outside the range of f32, and its state after an error.

use std::task::Poll;

use actq::budget::Budget;
use actq::contract::ActionContract;
use actq::graph::ops::{LayerNorm, Linear, Normalize, Pointwise, RmsNorm};
use actq::graph::{Graph, NodeKind, WeightMatrix};
use actq::methods::scale::round_to_nearest;
use actq::methods::{Method, Options, Outcome};
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_kernels::math::Function;
use actq_kernels::{Head, StepError, Width};

use crate::playback::with_head;

/// Length of observation, hidden values and action.
const N: usize = 2;
const MAX_STEP: f32 = 0.25;

/// An image of a policy that multiplies the observation by `gain`, then by `factor`, and then does `nodes`. (The
/// self-test's observations are about `1 / gain`.)
fn image(gain: f32, factor: f32, nodes: Vec<NodeKind>, contract: ActionContract) -> ImageBuffer {
    let mut graph = Graph::new(N);
    graph.matrices.push(WeightMatrix { name: "w".into(), rows: N, cols: N, data: vec![factor, 0.0, 0.0, factor] });
    let unlimited = f32::INFINITY;
    let normalize = Normalize { mean: vec![0.0; N], scale: vec![gain; N], pre_clip: unlimited, clip: unlimited };
    let first = [normalize.into(), Linear { matrix: 0, bias: vec![0.0; N] }.into()];
    for (input, kind) in first.into_iter().chain(nodes).enumerate() {
        graph.add(kind, &[input]).expect("it fits");
    }
    // Not by a method, which would move the factors to where nothing overflows.
    let (options, matrix) = (Options::new(Method::Rtn, Budget::Width(Width::W8)), &graph.matrices[0]);
    let quantized = round_to_nearest(matrix, Width::W8, options.group);
    let outcomes = [Outcome::new(matrix, quantized, None, options.activations).expect("the matrix is finite")];
    let policy = Policy { contract, ..Policy::of("faults", graph) };
    ImageBuffer::new(&actq::emit::image(&policy, &outcomes).expect("the policy fits the format"))
}

fn step_limit() -> ImageBuffer {
    image(1.0, 1.0, vec![], ActionContract { max_step: Some(vec![MAX_STEP; N]), ..ActionContract::default() })
}

#[test]
fn errors_keep_the_last_action_for_limits() {
    let ends: [fn(&mut Head<'_, '_>) -> StepError; 4] = [
        |head| head.step(&[f32::NAN, 0.0]).expect_err("the observation is not finite"),
        |head| head.step(&[0.0]).expect_err("the observation is short"),
        |head| head.begin(&[0.0, f32::INFINITY]).expect_err("the observation is not finite"),
        |head| head.infer(&[f32::NEG_INFINITY, 0.0]).expect_err("the observation is not finite"),
    ];
    with_head(&step_limit(), |head| {
        for end in ends {
            head.reset();
            // The first action after a reset has no step limit.
            let first = head.step(&[1.0, 1.0]).expect("an action").to_vec();
            assert!(first.iter().all(|a| (a - 1.0).abs() < 0.01), "{first:?}");
            let error = end(head);
            let next = head.step(&[-1.0, -1.0]).expect("an action");
            for (next, first) in next.iter().zip(&first) {
                assert_eq!(*next, first - MAX_STEP, "after {error:?}");
            }
            end(head);
            head.begin(&[-1.0, -1.0]).expect("the observation is finite");
            let Ok(Poll::Ready(next)) = head.poll(u32::MAX) else { panic!("the step has no end") };
            assert_eq!(next[0], first[0] - 2.0 * MAX_STEP, "after {error:?}");
        }
        head.reset();
        let first = head.step(&[-1.0, -1.0]).expect("an action");
        assert!((first[0] + 1.0).abs() < 0.01, "a reset lifts the limit: {first:?}");
    });
}

#[test]
fn an_error_within_an_action_changes_no_value() {
    // The second value's scale takes it out of f32's range; the first stays inside.
    let contract =
        ActionContract { scale: Some(vec![1.0, 1e38]), max_step: Some(vec![MAX_STEP; N]), ..ActionContract::default() };
    with_head(&image(1.0, 1.0, vec![], contract), |head| {
        head.reset();
        let first = head.step(&[1.0, 0.0]).expect("an action").to_vec();
        assert_eq!(head.step(&[-1.0, 100.0]).err(), Some(StepError::NotFinite));
        let next = head.step(&[-1.0, 0.0]).expect("an action");
        assert_eq!(next[0], first[0] - MAX_STEP, "the failed step moved the first value");
    });
}

/// An operation that turned a value beyond f32's range into a finite one would let a broken network drive the robot.
#[test]
fn no_operation_hides_an_overflow() {
    let clip = |limit| {
        let (pre_clip, clip) = if limit { (1.0, f32::INFINITY) } else { (f32::INFINITY, 1.0) };
        NodeKind::from(Normalize { mean: vec![0.0; N], scale: vec![1.0; N], pre_clip, clip })
    };
    let one = || vec![1.0; N];
    // The exponential of such large values is itself infinite: no image passes its self-test.
    let cases: Vec<(&str, Vec<NodeKind>)> = Function::ALL
        .into_iter()
        .filter(|function| *function != Function::Exp)
        .map(|function| (function.name(), vec![Pointwise(function).into()]))
        .chain([
            ("clip before", vec![clip(true)]),
            ("clip", vec![clip(false)]),
            ("layer norm", vec![LayerNorm { weight: one(), bias: one(), eps: 1e-5 }.into()]),
            ("RMS norm", vec![RmsNorm { weight: one(), eps: 1e-5 }.into()]),
            ("linear", vec![Linear { matrix: 0, bias: one() }.into()]),
        ])
        .collect();
    for (name, nodes) in cases {
        with_head(&image(1e15, 1e10, nodes, ActionContract::default()), |head| {
            for observation in [[2e15, 1.0], [-2e15, 1.0], [1.0, -2e15], [1.0, 2e15]] {
                assert_eq!(head.step(&observation).err(), Some(StepError::NotFinite), "{name} of {observation:?}");
            }
        });
    }
}

/// The values are finite; their squares are not.
#[test]
fn a_norm_with_overflowing_squares_is_an_error() {
    let one = || vec![1.0; N];
    for norm in
        [LayerNorm { weight: one(), bias: one(), eps: 1e-5 }.into(), RmsNorm { weight: one(), eps: 1e-5 }.into()]
    {
        with_head(&image(1e15, 1e10, vec![norm], ActionContract::default()), |head| {
            assert_eq!(head.step(&[1e5, -1e5]).err(), Some(StepError::NotFinite));
        });
    }
}
