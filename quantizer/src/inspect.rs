//! What is in an image, for people.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use actq_kernels::Image;
use actq_kernels::image::{Kind, Op, OpKind, Region};
use actq_kernels::linear::Matrix;
use comfy_table::{CellAlignment, Table, presets};

use crate::text::printable;

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
    image.ops().filter_map(|op| op.matrix()).filter(|m| seen.insert(place(m))).collect()
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
    let _ = writeln!(text, "policy        {}", printable(image.name()));
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
    let contract = image.contract_arrays();
    let mut actions = table(&["action", "scale", "offset", "low", "high", "max step"]);
    for i in 0..image.act_len() {
        let cell =
            |array: &[u32]| array.get(i).map_or("-".to_owned(), |w| format!("{}", f32::from_bits(u32::from_le(*w))));
        actions.add_row([i.to_string()].into_iter().chain(contract.map(cell)));
    }
    let _ = writeln!(text, "{actions}");
    text
}

/// The name of an operation.
pub fn op_name(op: &Op<'_>) -> &'static str {
    match op.kind {
        OpKind::Normalize => "normalize",
        OpKind::Linear { .. } => "linear",
        OpKind::Function(function) => function.name(),
        OpKind::LayerNorm => "layernorm",
        OpKind::RmsNorm => "rmsnorm",
        OpKind::Add => "add",
        OpKind::Copy => "copy",
        OpKind::LstmCell => "lstm cell",
        OpKind::GruCell => "gru cell",
    }
}

fn row(op: &Op<'_>) -> Vec<String> {
    let region = |r: Region| if r.len > 0 { format!("{}+{}", r.offset, r.len) } else { String::new() };
    let matrix = op.matrix();
    let detail = match (op.kind, &matrix) {
        (OpKind::Linear { accumulate }, Some(matrix)) => {
            format!("{}x{}{}", matrix.rows, matrix.cols, if accumulate { " added" } else { "" })
        }
        (OpKind::Normalize, _) => format!("clip {} {}", op.constant(0), op.constant(1)),
        (OpKind::LayerNorm | OpKind::RmsNorm, _) => format!("eps {}", op.constant(0)),
        (OpKind::LstmCell, _) => format!("cell {}", region(op.third())),
        (OpKind::GruCell, _) => format!("gates {}", region(op.third())),
        _ => String::new(),
    };
    let mut cells = vec![op_name(op).to_owned(), region(op.dst()), region(op.src()), detail];
    if let Some(matrix) = &matrix {
        cells.extend([
            widths(matrix),
            group_name(matrix.group),
            matrix.x_max.to_string(),
            matrix.weight_bytes().to_string(),
        ]);
    }
    cells
}
