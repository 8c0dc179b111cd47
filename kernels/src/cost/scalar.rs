//! Items of products in the layouts without lanes. Their loops take a tile of columns for all rows before the next, as
//! many as the work area has room for: `arch/portable/planes.rs`, `pairs.rs` and `bytes.rs`.

use super::item::{Gemv, Strips};
use super::{CostItem, rows_in_place, scaled};
use crate::activations::Plan;
use crate::arch::{LEAST_PAIRS, TABLE_WORDS, TWO_COLUMNS, Tables};
use crate::layout::{BlockShape, Format, QUAD, STRIP, Width, w4_scalar::W4Scalar};
use crate::meter::RUN;

/// Counts the items of a block's products and their scaling, as [`super::block`] does.
pub(super) fn block(shape: BlockShape, in_order: bool, start: bool, add: &mut dyn FnMut(CostItem, usize)) {
    let memory = Plan::new(shape).map_or(0, |plan| plan.work(shape.cols) - plan.words());
    let whole = if in_order && start { rows_in_place(shape) } else { 0 };
    if whole > 0 {
        add(CostItem::IN_PLACE, 1);
        scaled(whole, true, add);
        products(shape, whole, 1, memory, add);
    }
    let left = shape.rows - whole;
    if left > 0 {
        let sums = if whole == 0 { Tables::sums(memory, left) } else { None };
        let (run, memory) = sums.map_or((RUN, memory), |sums| (sums, memory - sums));
        let runs = left.div_ceil(run);
        add(CostItem::STACK, 1);
        add(CostItem::RUN, runs);
        products(shape, left, runs, memory, add);
        scaled(left, in_order, add);
    }
}

/// Counts the items of GEMVs of `rows` rows in `calls` calls, with tiles in `memory` words: of a call, of building a
/// tile (a chunk) and each of its units (a pass), and of a strip for each tile and group (a strip) and for its columns.
fn products(shape: BlockShape, rows: usize, calls: usize, memory: usize, add: &mut dyn FnMut(CostItem, usize)) {
    let units = shape.units();
    let tile = match shape.width {
        Width::W2 | Width::W3 => (memory / TABLE_WORDS).max(1),
        Width::W4 => W4Scalar::X.chunk / W4Scalar::CELL.cols,
        Width::W8 => (memory / TWO_COLUMNS).max(LEAST_PAIRS) & !3,
    };
    let group = shape.units_per_group();
    // Tiles of tables are cut at the ends of groups for each strip; those of other layouts end with a group.
    let cut = matches!(shape.width, Width::W2 | Width::W3);
    let of_groups = shape.groups() * group.min(units).div_ceil(tile);
    let (tiles, pieces) = match (shape.group, cut) {
        (0, _) => (units.div_ceil(tile), units.div_ceil(tile)),
        (_, false) => (of_groups, of_groups),
        (_, true) => {
            let ends = |every: usize| (1..units).filter(move |unit| unit.is_multiple_of(every));
            let both = ends(tile).filter(|unit| unit.is_multiple_of(group)).count();
            (units.div_ceil(tile), 1 + ends(tile).count() + ends(group).count() - both)
        }
    };
    let quads = rows.div_ceil(QUAD);
    let eights = if shape.strip_rows() == STRIP { quads / 2 } else { 0 };
    for (which, count) in [(Gemv::Call, calls), (Gemv::Chunk, calls * tiles), (Gemv::Pass, calls * units)] {
        add(CostItem::gemv_of(shape, Strips::Eight, which), count);
    }
    for (height, strips) in [(Strips::Eight, eights), (Strips::Four, quads - 2 * eights)] {
        add(CostItem::gemv_of(shape, height, Gemv::Strip), strips * pieces);
        add(CostItem::gemv_of(shape, height, Gemv::Column), strips * units);
    }
}
