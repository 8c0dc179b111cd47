//! What is in an image, for people.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use actq_kernels::Image;
use actq_kernels::image::{Kind, Op, Region};
use actq_kernels::linear::Matrix;
use comfy_table::{CellAlignment, Table, presets};

/// Bits per weight of the policy as it was trained: codes, padding, scales, indexes and block records of all matrices over the
/// number of the source's weights. A matrix that several operations share counts once.
pub fn bits_per_weight(image: &Image<'_>) -> f64 {
    let bytes: usize = distinct(image).iter().map(Matrix::weight_bytes).sum();
    8.0 * bytes as f64 / image.source_weights().max(1) as f64
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// The matrices, each once, in the order of the operations that use them first.
pub(crate) fn distinct<'a>(image: &Image<'a>) -> Vec<Matrix<'a>> {
    let mut seen = BTreeSet::new();
    let place = |m: &Matrix<'a>| m.blocks().next().map(|rows| rows.block.rows_from(0).as_ptr() as usize);
    image
        .ops()
        .filter_map(|op| match op {
            Op::Linear { matrix, .. } => Some(matrix),
            _ => None,
        })
        .filter(|m| seen.insert(place(m)))
        .collect()
}

/// A table without lines, numbers to the right.
pub fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Widths of a matrix's rows as text: `3`, or `2x200 4x56` where they differ.
pub fn widths(matrix: &Matrix<'_>) -> String {
    let blocks: Vec<_> = matrix.blocks().map(|rows| rows.block.shape()).collect();
    match &blocks[..] {
        [] => "0".to_owned(),
        [one] if one.rows == matrix.rows => one.width.bits().to_string(),
        many => many.iter().map(|s| format!("{}x{}", s.width.bits(), s.rows)).collect::<Vec<_>>().join(" "),
    }
}

/// Group size as text.
pub fn group_name(group: usize) -> String {
    if group == 0 { "row".to_owned() } else { group.to_string() }
}

/// The report that `actq inspect` prints.
pub fn report(image: &Image<'_>) -> String {
    let mut text = String::new();
    let digest = hex(&image.digest());
    let kind = match image.kind() {
        Kind::Step => "step".to_owned(),
        Kind::Chunk => format!("chunk of {}, {} executed", image.chunk(), image.execute()),
    };
    let (obs, act) = (image.obs_len(), image.act_len());
    let rate = image.rate_hz();
    let _ = writeln!(text, "policy        {}", image.name());
    let _ = writeln!(text, "source        sha256 {digest}");
    let _ = writeln!(text, "image         {} bytes, crc32 {:08x}", image.bytes(), image.crc());
    let _ = writeln!(text, "kind          {kind}, {obs} observations -> {act} actions at {rate} Hz");
    let _ = writeln!(text, "weights       {:.3} bits each, everything counted", bits_per_weight(image));
    let _ =
        writeln!(text, "scratch       {} bytes, {} of them state", 4 * image.scratch_words(), 4 * image.state().len);
    let _ = writeln!(text, "self-test     {} steps\n", image.self_test_steps());
    let mut ops = table(&["op", "output", "input", "detail", "bits", "group", "x max", "bytes"]);
    for op in image.ops() {
        ops.add_row(row(&op));
    }
    let _ = writeln!(text, "{ops}\n");
    let contract = image.contract();
    let mut actions = table(&["action", "scale", "offset", "low", "high", "max step"]);
    for i in 0..image.act_len() {
        let cell =
            |array: &[u32]| array.get(i).map_or("-".to_owned(), |w| format!("{}", f32::from_bits(u32::from_le(*w))));
        actions.add_row([
            i.to_string(),
            cell(contract.scale),
            cell(contract.offset),
            cell(contract.low),
            cell(contract.high),
            cell(contract.max_step),
        ]);
    }
    let _ = writeln!(text, "{actions}");
    text
}

/// The name of an operation.
pub fn op_name(op: &Op<'_>) -> &'static str {
    match op {
        Op::Normalize { .. } => "normalize",
        Op::Linear { .. } => "linear",
        Op::Function { function, .. } => function.name(),
        Op::LayerNorm { .. } => "layernorm",
        Op::RmsNorm { .. } => "rmsnorm",
        Op::Add { .. } => "add",
        Op::Copy { .. } => "copy",
        Op::LstmCell { .. } => "lstm cell",
        Op::GruCell { .. } => "gru cell",
    }
}

fn row(op: &Op<'_>) -> Vec<String> {
    let region = |r: &Region| format!("{}+{}", r.offset, r.len);
    let line = |dst: &Region, src: Option<&Region>, detail: String| {
        vec![op_name(op).to_owned(), region(dst), src.map_or(String::new(), region), detail]
    };
    match op {
        Op::Normalize { src, dst, pre_clip, clip, .. } => line(dst, Some(src), format!("clip {pre_clip} {clip}")),
        Op::Linear { src, dst, matrix, accumulate } => {
            let detail = format!("{}x{}{}", matrix.rows, matrix.cols, if *accumulate { " added" } else { "" });
            let mut cells = line(dst, Some(src), detail);
            cells.extend([
                widths(matrix),
                group_name(matrix.group),
                matrix.x_max.to_string(),
                matrix.weight_bytes().to_string(),
            ]);
            cells
        }
        Op::Function { dst, .. } => line(dst, None, String::new()),
        Op::LayerNorm { dst, eps, .. } => line(dst, None, format!("eps {eps}")),
        Op::RmsNorm { dst, eps, .. } => line(dst, None, format!("eps {eps}")),
        Op::Add { src, dst } => line(dst, Some(src), String::new()),
        Op::Copy { src, dst } => line(dst, Some(src), String::new()),
        Op::LstmCell { src, dst, cell } => line(dst, Some(src), format!("cell {}", region(cell))),
        Op::GruCell { src, dst, hidden } => line(dst, Some(src), format!("gates {}", region(hidden))),
    }
}
