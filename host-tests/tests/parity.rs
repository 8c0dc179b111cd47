//! Packing, the reference and the portable kernels against the definition, by property and on the golden cases.

use actq_host_tests::golden::{self, Case, Draw, Random};
use actq_kernels::activations::{NotFinite, Prepared, prepared_words, quantize};
use actq_kernels::dequantize;
use actq_kernels::format::{Block, BlockShape, QUAD, Width, pack};
use actq_kernels::gemv::{BACKEND, Backend, Mismatch, gemv};
use actq_kernels::linear::{worst_case, worst_case_bound};
use actq_kernels::{portable, reference};
use half::f16;
use proptest::prelude::*;

fn shapes() -> impl Strategy<Value = BlockShape> {
    let width = prop::sample::select(Width::ALL.to_vec());
    let group = prop::sample::select(vec![0, 32, 64, 128]);
    (width, 1..14usize, 1..140usize, group).prop_map(|(width, rows, cols, group)| BlockShape {
        width,
        rows,
        cols,
        group,
    })
}

fn cases() -> impl Strategy<Value = Case> {
    let draw = prop::sample::select(vec![Draw::Uniform, Draw::Ends, Draw::Worst]);
    (shapes(), any::<u64>(), 1..=i16::MAX, draw)
        .prop_map(|(shape, seed, x_max, draw)| Case::draw(&mut Random(seed), shape, x_max, draw))
}

fn check_backends(case: &Case, start: usize) {
    let sums = case.sums();
    assert_eq!(case.run(start, |b, x, acc| reference::gemv(b, x, 0, acc)), sums, "reference, {:?}", case.shape);
    assert_eq!(case.run(start, |b, x, acc| portable::gemv(b, x, 0, acc)), sums, "portable, {:?}", case.shape);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn backends_compute_the_definition(case in cases(), start in 0..4usize) {
        check_backends(&case, start);
    }

    #[test]
    fn unpacking_gives_back_what_was_packed(case in cases()) {
        let words = case.words();
        let block = Block::new(case.shape, &words).expect("the words fit the shape");
        let mask = ((1u32 << case.shape.width.bits()) - 1) as u8;
        for row in 0..case.shape.rows {
            for col in 0..case.shape.cols {
                prop_assert_eq!(block.code(row, col), case.codes[row * case.shape.cols + col] & mask);
                let scale = match case.shape.group {
                    0 => 1,
                    group => case.scales[row * case.shape.groups() + col / group],
                };
                prop_assert_eq!(block.group_scale(row, col), scale);
            }
        }
    }

    #[test]
    fn any_run_of_quads_gives_the_same_sums(case in cases(), first in 0..4usize) {
        let all = case.sums();
        let first = first.min(all.len() - 1);
        let part = case.run(0, |b, x, acc| {
            let mut sums = vec![[0; QUAD]; acc.len() - first];
            gemv(b, x, first, &mut sums).expect("the activations belong to the block");
            acc[first..].copy_from_slice(&sums);
        });
        prop_assert_eq!(&part[first..], &all[first..]);
    }

    #[test]
    fn sums_stay_within_the_proven_worst_case(case in cases()) {
        let words = case.words();
        let block = Block::new(case.shape, &words).expect("the words fit the shape");
        let x_max = case.x.iter().map(|x| x.unsigned_abs()).max().unwrap_or(0);
        let worst = worst_case(&block, x_max);
        prop_assert!(worst <= worst_case_bound(&block, x_max));
        if worst <= i64::from(i32::MAX) {
            prop_assert!(case.sums().as_flattened().iter().all(|s| i64::from(s.unsigned_abs()) <= worst));
        }
    }

    #[test]
    fn quantized_activations_round_to_half_a_step(
        x in prop::collection::vec(-1e6f32..1e6, 1..200),
        x_max in prop::sample::select(vec![127u16, 2047, 32767]),
        group in prop::sample::select(vec![0usize, 32, 64, 128]),
    ) {
        let mut words = vec![!0; prepared_words(x.len(), group)];
        let scale = quantize(&x, x_max, group, &mut words).expect("all values are finite");
        let prepared = Prepared::new(&words, x.len(), group).expect("the length is right");
        for (i, x) in x.iter().enumerate() {
            let q = prepared.value(i);
            prop_assert!(q.unsigned_abs() <= x_max);
            // Half a step, and the rounding of the f32 product before it.
            let error = (f64::from(*x) - f64::from(scale) * f64::from(q)).abs();
            prop_assert!(error <= f64::from(scale) * (0.5 + f64::from(x_max) * 2e-7), "{x} became {q}");
        }
    }
}

#[test]
fn golden_cases_hold_on_the_host() {
    for (i, case) in golden::cases(1).iter().enumerate() {
        check_backends(case, i % 4);
    }
}

#[test]
fn this_build_uses_the_portable_backend() {
    // The firmware's golden run asserts the other one.
    assert_eq!(BACKEND, Backend::Portable);
}

#[test]
fn shapes_and_lengths_that_do_not_fit_are_refused() {
    let shape = BlockShape { width: Width::W3, rows: 5, cols: 33, group: 0 };
    let mut words = vec![0; shape.words()];
    assert!(pack(shape, &[0; 5 * 33], &[], &mut words).is_some());
    assert!(pack(shape, &[0; 5 * 33 - 1], &[], &mut words).is_none(), "too few codes");
    assert!(pack(shape, &[0; 5 * 33], &[1], &mut words).is_none(), "scales without groups");
    assert!(pack(shape, &[0; 5 * 33], &[], &mut words[1..]).is_none(), "too few words");
    for bad in [
        BlockShape { rows: 0, ..shape },
        BlockShape { cols: 0, ..shape },
        BlockShape { group: 16, ..shape },
        BlockShape { cols: 1 << 16, ..shape },
    ] {
        assert!(Block::new(bad, &vec![0; bad.words()]).is_none(), "{bad:?}");
    }
    let block = Block::new(shape, &words).expect("the words fit the shape");
    let other = vec![0; prepared_words(33, 32)];
    let x = Prepared::new(&other, 33, 32).expect("the length is right");
    assert_eq!(gemv(&block, &x, 0, &mut [[0; QUAD]; 2]), Err(Mismatch), "another group");
}

#[test]
fn vectors_that_are_not_finite_are_refused_and_tiny_ones_are_zero() {
    let mut words = [0; 17];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(quantize(&[1.0, bad], 127, 0, &mut words), Err(NotFinite));
    }
    words.fill(!0);
    assert_eq!(quantize(&[1e-35, -1e-40, 0.0], 127, 0, &mut words), Ok(0.0));
    assert!(words.iter().all(|w| *w == 0));
}

#[test]
fn dequantization_agrees_over_its_three_types() {
    let mut random = Random(5);
    for width in Width::ALL {
        for group in [0, 32] {
            let shape = BlockShape { width, rows: 6, cols: 70, group };
            let case = Case::draw(&mut random, shape, 1, Draw::Uniform);
            // The image is the only source of row blocks; one with a single matrix holds the case.
            let image = single_matrix_image(&case);
            let buffer = actq::runtime::ImageBuffer::new(&image);
            let image = actq_kernels::Image::new_checked(buffer.bytes()).expect("the image is valid");
            let matrix = image
                .ops()
                .find_map(|op| match op {
                    actq_kernels::image::Op::Linear { matrix, .. } => Some(matrix),
                    _ => None,
                })
                .expect("the image has a matrix");
            for rows in matrix.blocks() {
                for i in 0..shape.rows {
                    let (mut f, mut h, mut n) = ([0f32; 70], [f16::ZERO; 70], [0i16; 70]);
                    dequantize::row_f32(&rows, i, &mut f);
                    dequantize::row_f16(&rows, i, &mut h);
                    dequantize::row_i16(&rows, i, &mut n);
                    for col in 0..shape.cols {
                        let at = i * shape.cols + col;
                        let scale = case.scales.get(i * shape.groups() + col / 32).map_or(1, |s| i32::from(*s));
                        let integer = width.level(case.codes[at]) * scale;
                        assert_eq!(i32::from(n[col]), integer);
                        assert_eq!(f[col], integer as f32 * rows.scale(i));
                        assert_eq!(h[col], f16::from_f32(f[col]));
                    }
                }
            }
        }
    }
}

fn single_matrix_image(case: &Case) -> Vec<u8> {
    use actq::graph::{Graph, Matrix, Node, NodeKind};
    use actq::quantize::{Outcome, Quantized};
    let BlockShape { width, rows, cols, group } = case.shape;
    let mut graph = Graph::new(cols);
    graph.matrices.push(Matrix { name: "w".into(), rows, cols, data: vec![0.0; rows * cols] });
    let kind = NodeKind::Linear { matrix: 0, bias: vec![0.5; rows] };
    graph.nodes.push(Node { kind, input: 0, len: rows });
    let policy = actq::policy::Policy {
        dir: ".".into(),
        name: "single".into(),
        kind: actq_kernels::image::Kind::Step,
        chunk: 1,
        execute: 1,
        act_len: rows,
        rate_hz: 50.0,
        contract: actq::policy::Contract::default(),
        graph,
        weights: rows * cols,
        digest: [0; 32],
    };
    let quantized = Quantized {
        rows,
        cols,
        group,
        widths: vec![Some(width); rows],
        scales: (0..rows).map(|r| half::bf16::from_f32(0.01 * (r + 1) as f32)).collect(),
        group_scales: case.scales.clone(),
        codes: case.codes.clone(),
    };
    actq::writer::image(&policy, &[Outcome { quantized, error: None, x_max: 127 }]).expect("the policy fits the format")
}
