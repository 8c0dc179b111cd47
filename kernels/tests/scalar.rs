//! The kernels of the scalar layouts, and those of the layouts for Helium, against the reference, with memory for any number of tables.
#![expect(clippy::expect_used, reason = "a test")]

use actq_kernels::activations::{Plan, prepare};
use actq_kernels::arch::{Product, Tables, gemv_with, reference};
use actq_kernels::image::worst_case;
use actq_kernels::layout::{Block, BlockShape, Lanes, Width, pack};
use actq_testkit::Random;

/// Lanes of other cores than those with the DSP extension.
const LANES: [Lanes; 2] = [Lanes::Scalar, Lanes::Helium];

/// Draws values at the ends of their range in every third case, and all at one end in every other third.
fn check(random: &mut Random, shape: BlockShape, case: usize) {
    let BlockShape { rows, cols, width, .. } = shape;
    let mut byte = |i: usize| match case % 3 {
        0 => random.byte(),
        1 => [0, 255][usize::from(random.byte() & 1)],
        _ => [0, 255][i % 2],
    };
    // 0x80 is the lowest code at 8 bits.
    let codes: Vec<u8> =
        (0..rows * cols).map(|i| byte(i / cols)).map(|c| if width == Width::W8 { c ^ 0x80 } else { c }).collect();
    let x: Vec<i16> = (0..cols).map(|_| byte(case)).map(|x| i16::from(x.max(1)) - 128).collect();
    let scales: Vec<u8> = (0..rows * shape.groups()).map(&mut byte).collect();
    let mut words = vec![0; shape.words()];
    pack(shape, &codes, &scales, &mut words).expect("the codes fit the shape");
    let block = Block::new(shape, &words).expect("the words fit the shape");
    let plan = Plan::of(&block);
    let mut prepared = vec![0; plan.words()];
    let x = prepare(&x, &plan, &mut prepared).expect("there is room");
    let mut expected = vec![0; shape.padded_rows()];
    reference::gemv(Product::new(&block, &x, 0, &mut expected).expect("they fit"));
    let weight = |row, col| block.level(row, col).unsigned_abs() * u32::from(block.group_scale(row, col));
    let largest = (0..rows).map(|row| (0..cols).map(|col| weight(row, col)).sum::<u32>()).max();
    assert_eq!(Some(worst_case(&block, 127)), largest.map(|sum| 127 * i64::from(sum)), "{shape:?}");
    for memory in [0, 127, 128, 3 * 128, 8 * 128, 9 * 128 + 5] {
        let (mut work, mut sums) = (vec![!0; memory], vec![!0; shape.padded_rows()]);
        let (_, tables) = Tables::split(&mut work, 0);
        gemv_with(&block, &x, 0, &mut sums, tables).expect("they fit");
        assert_eq!(sums[..rows], expected[..rows], "{shape:?}, {memory} words for tables");
        for first in (8..shape.padded_rows()).step_by(8) {
            let (_, tables) = Tables::split(&mut work, 0);
            gemv_with(&block, &x, first, &mut sums[first..], tables).expect("they fit");
        }
        assert_eq!(sums[..rows], expected[..rows], "{shape:?}, in parts");
    }
}

#[test]
fn sums_are_those_of_the_reference() {
    let mut random = Random::new(1);
    for case in 0..3000 {
        let width = Width::ALL[random.below(4)];
        let (rows, cols) = (1 + random.below(21), 1 + random.below([70, 300][case % 2]));
        let group = [0, 0, 32, 64, 128][random.below(5)];
        check(&mut random, BlockShape { width, lanes: LANES[case / 2 % LANES.len()], rows, cols, group }, case);
    }
}

/// The largest sum of every block of up to three columns, for activations at the ends of their range, is the proven one.
#[test]
fn the_worst_case_of_every_small_block_is_reached() {
    const X_MAX: i16 = 127;
    for (width, lanes, group) in Width::ALL.into_iter().flat_map(|width| {
        [Lanes::Single, Lanes::Paired, Lanes::Scalar, Lanes::Helium]
            .into_iter()
            .flat_map(move |lanes| [0, 32].map(|group| (width, lanes, group)))
    }) {
        let whole = [0x80, 0x81, 0xff, 0, 1, 0x7f];
        let codes: Vec<u8> = if width == Width::W8 { whole.to_vec() } else { (0..1 << width.bits()).collect() };
        for cols in 1..=3 {
            let shape = BlockShape { width, lanes, rows: 1, cols, group };
            if !shape.is_valid() {
                continue;
            }
            for (case, scale) in (0..codes.len().pow(cols as u32)).zip([255, 1, 77].into_iter().cycle()) {
                let of_case: Vec<u8> =
                    (0..cols as u32).map(|col| codes[case / codes.len().pow(col) % codes.len()]).collect();
                let mut words = vec![0; shape.words()];
                pack(shape, &of_case, &vec![scale; shape.groups()], &mut words).expect("the codes fit the shape");
                let block = Block::new(shape, &words).expect("the words fit the shape");
                let plan = Plan::of(&block);
                let (mut prepared, mut sums) = (vec![0; plan.words()], vec![0; shape.padded_rows()]);
                let mut largest = 0;
                for signs in 0..1 << cols {
                    let x: Vec<i16> = (0..cols).map(|col| if signs >> col & 1 == 0 { X_MAX } else { -X_MAX }).collect();
                    let x = prepare(&x, &plan, &mut prepared).expect("there is room");
                    reference::gemv(Product::new(&block, &x, 0, &mut sums).expect("they fit"));
                    largest = largest.max(sums[0].unsigned_abs());
                }
                assert_eq!(worst_case(&block, X_MAX as u16), i64::from(largest), "{shape:?}, {of_case:?}");
            }
        }
    }
}
