//! Packing, the reference and the portable kernels against the definition, by property tests and on the golden cases.

use actq_bench::bits;
use actq_bench::golden::{self, Case, Draw, Random};
use actq_kernels::activations::{NotFinite, Plan, Prepared, Scale, prepare};
use actq_kernels::arch::{BACKEND, Backend, Mismatch, Product, gemv, portable, reference};
use actq_kernels::image::{RowBlock, header as h, largest_sum_bound, worst_case};
use actq_kernels::layout::{Block, BlockShape, Lanes, MAX_PAIRED_GROUPED, PackError, STRIP, Width, pack};
use proptest::prelude::*;

use crate::draft::Draft;

fn shapes() -> impl Strategy<Value = BlockShape> {
    let layout = prop::sample::select(golden::layouts().collect::<Vec<_>>());
    (layout, 1..18usize, prop_oneof![9 => 1..140usize, 1 => 140..700usize])
        .prop_map(|((width, lanes, group), rows, cols)| BlockShape { width, lanes, rows, cols, group })
}

fn cases() -> impl Strategy<Value = Case> {
    let draw = prop::sample::select(vec![Draw::Uniform, Draw::Ends, Draw::Worst, Draw::Aligned]);
    (shapes(), any::<u64>(), 1..=i16::MAX, draw).prop_map(|(shape, seed, x_max, draw)| {
        let x_max = match shape.lanes {
            Lanes::Single => x_max,
            Lanes::Paired | Lanes::Scalar | Lanes::Helium => 1 + x_max % 127,
        };
        Case::draw(&mut Random::new(seed), shape, x_max, draw)
    })
}

fn check_backends(case: &Case, start: usize) {
    let sums = case.sums();
    for (name, backend) in [("reference", reference::gemv as fn(Product<'_>)), ("portable", portable::gemv)] {
        let gemv = |b: &Block<'_>, x: &Prepared<'_>, acc: &mut [i32]| {
            backend(Product::new(b, x, 0, acc).expect("the vector was prepared for the block"));
        };
        assert_eq!(case.run(start, gemv), sums, "{name}, {:?}", case.shape);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn backends_compute_the_definition(case in cases(), start in 0..4usize) {
        check_backends(&case, start);
    }

    #[test]
    fn unpacking_inverts_packing(case in cases()) {
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
    fn any_run_of_strips_gives_the_same_sums(case in cases(), first in 0..3usize, strips in 1..3usize) {
        let all = case.sums();
        let first = STRIP * first.min((all.len() - 1) / STRIP);
        let last = (first + STRIP * strips).min(all.len());
        let part = case.run(0, |b, x, acc| {
            gemv(b, x, first, &mut acc[first..last]).expect("the activations fit the block, and the rows are whole strips");
        });
        prop_assert_eq!(&part[first..last], &all[first..last]);
    }

    #[test]
    fn sums_stay_within_the_proven_worst_case(case in cases()) {
        let words = case.words();
        let block = Block::new(case.shape, &words).expect("the words fit the shape");
        let x_max = case.x.iter().map(|x| x.unsigned_abs()).max().unwrap_or(0);
        let worst = worst_case(&block, x_max);
        let product = |row, col| i64::from(block.level(row, col).abs()) * i64::from(block.group_scale(row, col));
        let row_sum = |row| (0..case.shape.cols).map(|col| product(row, col)).sum::<i64>();
        let largest = (0..case.shape.rows).map(row_sum).max().unwrap_or(0);
        prop_assert_eq!(worst, largest * i64::from(x_max));
        prop_assert!(worst <= i64::from(largest_sum_bound(block.shape())) * i64::from(x_max));
        if worst <= i64::from(i32::MAX) {
            prop_assert!(case.sums().iter().all(|s| i64::from(s.unsigned_abs()) <= worst));
        }
    }

    #[test]
    fn quantized_activations_round_to_half_a_step(
        x in prop::collection::vec(-1e6f32..1e6, 1..200),
        x_max in prop::sample::select(vec![127u16, 2047, 32767]),
        shape in shapes(),
    ) {
        let shape = BlockShape { cols: x.len(), ..shape };
        let x_max = if shape.lanes == Lanes::Single { x_max } else { 127 };
        let plan = Plan::new(shape).expect("the shape is valid");
        let mut words = vec![!0; plan.room(x.len())];
        let scale = Scale::new(&x, x_max).expect("all values are finite");
        let prepared = scale.quantize(&mut x.clone(), &plan, &mut words).expect("there is room");
        // The result from integers, word for word: start words, sums and padding, too.
        let integers: Vec<i16> = (0..x.len()).map(|col| prepared.value(col)).collect();
        let mut expected = vec![!0; plan.words() + 1];
        prop_assert_eq!(prepare(&integers, &plan, &mut expected).map(|x| x.words()), Some(prepared.words()));
        prop_assert_eq!(expected.last(), Some(&!0));
        let mut own: Vec<u32> = x.iter().map(|x| x.to_bits()).collect();
        let in_place = scale.quantize_in_place(&plan, &mut own).map(|x| x.words().to_vec());
        prop_assert_eq!(in_place, plan.fits_in_place().then(|| prepared.words().to_vec()));
        for (i, x) in x.iter().enumerate() {
            let q = prepared.value(i);
            prop_assert!(q.unsigned_abs() <= x_max);
            // Half a step, and the rounding of the f32 product before it.
            let step = f64::from(scale.get());
            let error = (f64::from(*x) - step * f64::from(q)).abs();
            prop_assert!(error <= step * (0.5 + f64::from(x_max) * 2e-7), "{x} became {q}");
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
    // The firmware's golden run asserts the other backend.
    assert_eq!(BACKEND, Backend::Portable);
}

#[test]
fn wrong_shapes_and_lengths_are_refused() {
    let shape = BlockShape { width: Width::W3, lanes: Lanes::Single, rows: 5, cols: 33, group: 0 };
    let mut words = vec![0; shape.words()];
    assert_eq!(pack(shape, &[0; 5 * 33], &[], &mut words), Ok(()));
    let refused = |codes: usize, scales: &[u8], out: &mut [u32]| pack(shape, &vec![0; codes], scales, out).err();
    let (n, len) = (5 * 33, words.len());
    assert_eq!(refused(n - 1, &[], &mut words), Some(PackError::Codes { expected: n, given: n - 1 }));
    assert_eq!(refused(n, &[1], &mut words), Some(PackError::Scales { expected: 0, given: 1 }));
    assert_eq!(refused(n, &[], &mut words[1..]), Some(PackError::Words { expected: len, given: len - 1 }));
    for bad in [
        BlockShape { rows: 0, ..shape },
        BlockShape { cols: 0, ..shape },
        BlockShape { group: 16, ..shape },
        BlockShape { lanes: Lanes::Paired, group: 64, ..shape },
        BlockShape { lanes: Lanes::Paired, group: 32, cols: MAX_PAIRED_GROUPED + 1, ..shape },
        BlockShape { cols: 1 << 16, ..shape },
    ] {
        assert!(Block::new(bad, &vec![0; bad.words()]).is_none(), "{bad:?}");
    }
    let block = Block::new(shape, &words).expect("the words fit the shape");
    let plan = Plan::of(&block);
    assert!(prepare(&[1; 33], &plan, &mut vec![0; plan.words() - 1]).is_none(), "too few words");
    let scale = Scale::new(&[1.0; 33], 127).expect("all values are finite");
    assert!(scale.quantize(&mut [1.0; 33], &plan, &mut vec![0; plan.room(33) - 1]).is_none(), "too little room");
    assert!(Plan::new(BlockShape { cols: 0, ..shape }).is_none(), "no columns");
    let prepared = vec![0; plan.words()];
    assert!(Prepared::new(&prepared[1..], &plan).is_none(), "too few words");
    let x = Prepared::new(&prepared, &plan).expect("the length is right");
    assert_eq!(gemv(&block, &x, 0, &mut [0; 8]), Ok(()));
    assert_eq!(gemv(&block, &x, 0, &mut [0; 4]), Err(Mismatch), "half a strip");
    assert_eq!(gemv(&block, &x, 4, &mut [0; 4]), Err(Mismatch), "from the middle of a strip");
    assert_eq!(gemv(&block, &x, 0, &mut [0; 16]), Err(Mismatch), "more rows than the block has");
    for other in [BlockShape { group: 32, ..shape }, BlockShape { lanes: Lanes::Paired, ..shape }] {
        let plan = Plan::new(other).expect("the shape is valid");
        let prepared = vec![0; plan.words()];
        let x = Prepared::new(&prepared, &plan).expect("the length is right");
        assert_eq!(gemv(&block, &x, 0, &mut [0; 8]), Err(Mismatch), "{other:?}");
    }
}

#[test]
fn lanes_must_follow_from_the_activations() {
    let shape = BlockShape { width: Width::W2, lanes: Lanes::Paired, rows: 9, cols: 40, group: 0 };
    let image = single_matrix_image(&Case::draw(&mut Random::new(7), shape, 1, Draw::Uniform));
    let check = |lanes: u32| {
        let mut image = Draft::of(&image);
        let block = image.offset(image.offset(h::W_MATRICES) + 3);
        image.set_low(block, image.low(block) & 0xff | lanes << 8);
        image.seal();
        image.check().map(|_| ())
    };
    assert_eq!(check(1), Ok(()));
    for lanes in [0, 4, 255] {
        assert_eq!(check(lanes), Err(actq_kernels::ImageError::Lanes), "{lanes}");
    }
    // The scalar layout has the same words, but its tables need a longer work area.
    assert_eq!(check(2), Err(actq_kernels::ImageError::Arena));
    // The layout for Helium has more columns of padding.
    assert_eq!(check(3), Err(actq_kernels::ImageError::Section));
}

/// Row blocks compute `start + acc * (row_scale * x_scale)` in this order, with biases in one pass or already in y.
#[test]
fn scaling_keeps_the_documented_order_of_operations() {
    let mut random = Random::new(11);
    for (width, lanes, group) in golden::layouts() {
        for rows in [1, 3, 8, 13, 17, 72] {
            let shape = BlockShape { width, lanes, rows, cols: 45, group };
            let case = Case::draw(&mut random, shape, 127, Draw::Uniform);
            let words = case.words();
            let scales: Vec<u32> =
                (0..rows.div_ceil(2)).map(|_| 0x3c00_3c00 | random.bits() as u32 & 0x7f_007f).collect();
            let bias: Vec<u32> = (0..rows).map(|_| random.unit().to_bits()).collect();
            let x: Vec<f32> = (0..45).map(|_| random.unit()).collect();
            let block = Block::new(shape, &words).expect("the words fit the shape");
            let block = RowBlock { block, scales: &scales, steps: &[], first_row: 0 };
            let scale = Scale::new(&x, 127).expect("all values are finite");
            let plan = Plan::of(&block.block);
            let mut prepared = vec![0; plan.room(x.len())];
            let prepared = scale.quantize(&mut x.clone(), &plan, &mut prepared).expect("there is room");
            let expected: Vec<u32> = (0..rows)
                .map(|i| {
                    let acc = reference::dot(&block.block, &prepared, i) as f32;
                    (f32::from_bits(bias[i]) + acc * (block.scale(i) * scale.get())).to_bits()
                })
                .collect();
            let mut y = vec![0.0; rows];
            block.apply(&prepared, scale, Some(&bias), &mut y).expect("the lengths fit");
            assert_eq!(bits(&y), expected, "{shape:?}");
            let mut y: Vec<f32> = bias.iter().map(|b| f32::from_bits(*b)).collect();
            block.apply(&prepared, scale, None, &mut y).expect("the lengths fit");
            assert_eq!(bits(&y), expected, "{shape:?}, start in y");
        }
    }
}

#[test]
fn vectors_are_refused_if_infinite_zero_if_tiny() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(Scale::new(&[1.0, bad], 127), Err(NotFinite));
    }
    let tiny = [1e-35, -1e-40, 0.0];
    let scale = Scale::new(&tiny, 127).expect("all values are finite");
    assert_eq!(scale.get(), 0.0);
    for (width, lanes, group) in golden::layouts() {
        let shape = BlockShape { width, lanes, rows: 1, cols: 3, group };
        let plan = Plan::new(shape).expect("the shape is valid");
        let mut words = vec![!0; plan.room(tiny.len())];
        let x = scale.quantize(&mut tiny.clone(), &plan, &mut words).expect("there is room");
        assert!((0..3).all(|col| x.value(col) == 0));
    }
}

#[test]
fn codes_decode_to_their_weights() {
    let mut random = Random::new(5);
    for width in Width::ALL {
        for group in [0, 32] {
            let shape = BlockShape { width, lanes: Lanes::Paired, rows: 6, cols: 70, group };
            let case = Case::draw(&mut random, shape, 1, Draw::Uniform);
            // The image is the only source of row blocks; one with a single matrix holds the case.
            let image = single_matrix_image(&case);
            let buffer = actq::runtime::ImageBuffer::new(&image);
            let image = actq_kernels::Image::new_checked(buffer.bytes()).expect("the image is valid");
            let matrix = image.ops().find_map(|op| op.matrix()).expect("the image has a matrix");
            for rows in matrix.blocks() {
                for i in 0..shape.rows {
                    let mut row = [0f32; 70];
                    rows.dequantize(i, &mut row);
                    for (col, weight) in row.iter().enumerate() {
                        let at = i * shape.cols + col;
                        let scale = case.scales.get(i * shape.groups() + col / 32).map_or(1, |s| i32::from(*s));
                        let integer = width.level(case.codes[at]) * scale;
                        assert_eq!(*weight, integer as f32 * rows.scale(i));
                    }
                }
            }
        }
    }
}

fn single_matrix_image(case: &Case) -> Vec<u8> {
    use actq::graph::ops::Linear;
    use actq::graph::{Graph, WeightMatrix};
    use actq::methods::{Outcome, Quantized};
    let BlockShape { width, rows, cols, group, .. } = case.shape;
    let mut graph = Graph::new(cols);
    graph.matrices.push(WeightMatrix { name: "w".into(), rows, cols, data: vec![0.0; rows * cols] });
    graph.add(Linear { matrix: 0, bias: vec![0.5; rows] }, &[0]).expect("it fits");
    let policy = actq::policy::Policy::of("single", graph);
    let quantized = Quantized {
        rows,
        cols,
        group,
        widths: vec![Some(width); rows],
        scales: (0..rows).map(|r| half::bf16::from_f32(0.01 * (r + 1) as f32)).collect(),
        group_scales: case.scales.clone(),
        codes: case.codes.clone(),
    };
    actq::emit::image(&policy, &[Outcome { quantized, error: None, x_max: 127, allocation: None }])
        .expect("the policy fits the format")
}
