//! The report of `actq inspect`.

use std::fmt::Write as _;

use actq::graph::ops::Balance;
use actq::measure::size::{Beside, bits_per_weight, file_bits_per_weight, hex};
use actq::policy::DEFAULT_RATE_HZ;
use actq::text::{count, printable};
use actq_kernels::image::Matrix;
use actq_kernels::image::{Cache, Kind, Op, OpKind, Region};
use actq_kernels::{Image, PortKind};

use super::memory::{Peak, peak};
use super::table::{group_name, table};

/// Names of the action contract's arrays, in the image's order.
pub(super) const CONTRACT: [&str; 10] =
    ["scale", "offset", "low", "high", "max step", "smoothing", "on from", "off to", "on is", "off is"];

/// Formats the widths of a matrix's rows: `3`, or `2x200 4x56` if they differ.
pub fn widths(matrix: &Matrix<'_>) -> String {
    let blocks: Vec<_> = matrix.blocks().map(|rows| rows.block.shape()).collect();
    match &blocks[..] {
        [] => "0".to_owned(),
        [one] if one.rows == matrix.rows => one.width.bits().to_string(),
        many => many.iter().map(|s| format!("{}x{}", s.width.bits(), s.rows)).collect::<Vec<_>>().join(" "),
    }
}

/// Formats the meaning of the network's output.
pub(super) fn kind(image: &Image<'_>) -> String {
    match image.kind() {
        Kind::Step => "step".to_owned(),
        Kind::Chunk => format!("chunk of {}, {} executed", image.chunk(), image.execute()),
        Kind::Flow | Kind::Diffusion => {
            let kind = if image.kind() == Kind::Flow { "flow" } else { "diffusion" };
            let (steps, chunk, execute) = (image.denoising_steps(), image.chunk(), image.execute());
            format!("{kind} in {}, chunk of {chunk}, {execute} executed", count(steps, "step"))
        }
        kind => format!("{kind:?}"),
    }
}

/// Returns whether an image may have its rate by default: it does not say whether its policy stated one; a bundle does.
pub fn may_be_default(image: &Image<'_>) -> bool {
    image.rate_hz() == DEFAULT_RATE_HZ && image.ports().next().is_none()
}

/// Formats the report that `actq inspect` prints.
pub fn report(image: &Image<'_>) -> String {
    let mut text = String::new();
    let digest = hex(&image.digest());
    let kind = kind(image);
    let (obs, act) = (count(image.obs_len(), "observation"), count(image.act_len(), "action"));
    let rate = format!(
        "{} Hz{}",
        image.rate_hz(),
        if may_be_default(image) { ", also the default of policies without a rate" } else { "" }
    );
    let _ = writeln!(text, "policy        {}", printable(image.name()));
    let _ = writeln!(text, "source        sha256 {digest}");
    let _ = writeln!(text, "image         {} bytes, crc32 {:08x}", image.bytes(), image.crc());
    let _ = writeln!(text, "kind          {kind}, {obs} -> {act} at {rate}");
    for port in image.ports() {
        let what = match port.kind {
            PortKind::Input => "input",
            PortKind::Position => "positions",
            PortKind::Velocity => "velocities",
            PortKind::Torque => "torques",
            _ => "output",
        };
        let [low, high] = port.range;
        let range = if low.is_finite() || high.is_finite() { format!(", {low} to {high}") } else { String::new() };
        let names = if port.names.is_empty() { String::new() } else { format!(": {}", port.names.replace('\n', ", ")) };
        let _ = writeln!(text, "{what:13} {} ({}{range}){names}", printable(port.name), count(port.len, "value"));
    }
    let playback = playback(image);
    if !playback.is_empty() {
        let _ = writeln!(text, "playback      {}", playback.join(", "));
    }
    let (bits, of_file) = (bits_per_weight(image), file_bits_per_weight(image));
    let _ =
        writeln!(text, "weights       {bits:.3} bits each, with scales and padding; {of_file:.3} of the whole file");
    let _ = writeln!(text, "beside them   {}", Beside::of(image));
    let words = image.scratch_words();
    let state = 4 * image.state().len;
    let _ = writeln!(text, "scratch       {words} words ({} bytes), {state} bytes of them state", 4 * words);
    for cache in image.prefix_caches() {
        let [tokens, heads] = [count(cache.prefix_slots(), "token"), count(cache.heads, "head")];
        let _ = writeln!(text, "prefix        at most {tokens} of {heads} of {}, from a host", cache.dim);
    }
    let Peak { op, words, placed } = peak(image);
    let name = image.ops().nth(op).map_or("", |op| op.kind.name());
    let _ = writeln!(text, "values        {} bytes, {} of them in use at op {op} ({name})", 4 * placed, 4 * words);
    let _ = writeln!(text, "self-test     {}", count(image.self_test_steps(), "step"));
    let features: Vec<_> = image.features().collect();
    let _ = writeln!(text, "features      {}, of the kernels on the target", features.join(" "));
    for (feature, cores) in [("scalar", "without the DSP extension"), ("helium", "with Helium")] {
        if features.contains(&feature) {
            let _ = writeln!(text, "layouts       of cores {cores}; slow on others: `actq repack` converts");
        }
    }
    let _ = writeln!(text);
    let mut ops = table(&["op", "output", "input", "detail", "bits", "group", "x max", "bytes"]);
    for op in image.ops() {
        ops.add_row(row(&op));
    }
    let _ = writeln!(text, "{ops}\n");
    let contract = image.contract_arrays();
    let columns: Vec<_> = CONTRACT.into_iter().zip(contract).filter(|(_, array)| !array.is_empty()).collect();
    if columns.is_empty() {
        let _ = writeln!(text, "actions       the network's output, without scale and limits");
        return text;
    }
    let heads: Vec<&str> = std::iter::once("action").chain(columns.iter().map(|(name, _)| *name)).collect();
    let mut actions = table(&heads);
    for i in 0..image.act_len() {
        let cell =
            |array: &[u32]| array.get(i).map_or("-".to_owned(), |w| format!("{}", f32::from_bits(u32::from_le(*w))));
        actions.add_row([i.to_string()].into_iter().chain(columns.iter().map(|(_, array)| cell(array))));
    }
    let _ = writeln!(text, "{actions}");
    text
}

/// Lists the settings of chunk playback that the image has.
pub(super) fn playback(image: &Image<'_>) -> Vec<String> {
    let mut settings = Vec::new();
    if image.horizon() > 0 {
        settings.push(format!("average of {}", count(image.horizon(), "chunk")));
    }
    if image.overlap() > 0 {
        settings.push(format!("{} actions blend into a new chunk", image.overlap()));
    }
    if let Some(periods) = image.deadline() {
        settings.push(format!("no action plays {periods} or more periods after its observation"));
    }
    settings
}

/// Describes an operation of attention by its sizes.
fn attention(op: &Op<'_>) -> String {
    let Cache { heads, dim, slots, own } = op.cache();
    if op.kind == OpKind::Keep {
        let of_steps = if op.is_ring() { "the last " } else { "" };
        let (tokens, after) = if own > 0 { (own, " after a prefix") } else { (slots, "") };
        return format!("{heads} x {dim} of {of_steps}{}{after}", count(tokens, "token"));
    }
    let (queries, causal) = (op.query_heads(), if op.is_causal() { " causal" } else { "" });
    format!("{queries} x {dim} to {heads} of {}{causal}, factor {}", count(slots, "token"), op.score_factor())
}

/// Formats the cells of an operation: name, output, input, detail, and those of its matrix.
pub(super) fn row(op: &Op<'_>) -> Vec<String> {
    let region = |r: Region| if r.len > 0 { format!("{}+{}", r.offset, r.len) } else { String::new() };
    let matrix = op.matrix();
    let detail = match (op.kind, &matrix) {
        (OpKind::Linear { accumulate, .. }, Some(matrix)) => {
            format!("{}x{}{}", matrix.rows, matrix.cols, if accumulate { " added" } else { "" })
        }
        (OpKind::RmsNorm, _) if op.constant(0) == Balance::FREE_EPS => "factors, by the quantizer".into(),
        (OpKind::History, _) => count(op.dst().len / op.src().len.max(1), "frame"),
        (OpKind::Keep | OpKind::Attend, _) => attention(op),
        (OpKind::Rotary, _) => {
            let [heads, dim] = op.rotated_heads();
            format!("{heads} x {dim}")
        }
        (kind, _) if kind.label().is_empty() => String::new(),
        (kind, _) => {
            let constants: String = op.constants().map(|constant| format!(" {constant}")).collect();
            let values = if constants.is_empty() { format!(" {}", region(op.third())) } else { constants };
            let by = if kind == (OpKind::Normalize { added: true }) { ", by the quantizer" } else { "" };
            format!("{}{values}{by}", kind.label())
        }
    };
    let mut cells = vec![op.kind.name().to_owned(), region(op.dst()), region(op.src()), detail];
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
