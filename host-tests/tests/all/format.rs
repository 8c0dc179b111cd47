//! `docs/FORMAT.md` against the library: its hex example, its bit diagrams and layouts, its sizes.

use std::fs;
use std::path::Path;

use actq::contract::ActionContract;
use actq::graph::ops::Linear;
use actq::graph::{Graph, WeightMatrix};
use actq::methods::{Outcome, Quantized};
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::root;
use actq_kernels::activations::{Plan, max_prepared_words};
use actq_kernels::image::{Image, Kind, OpKind, Region, block_bytes, checksum, header as h};
use actq_kernels::layout::{BlockShape, Lanes, MAX_PAIRED_GROUPED, Width, pack};
use actq_testkit::Random;
use half::bf16;

fn document() -> String {
    fs::read_to_string(root().join("docs/FORMAT.md")).expect("docs/FORMAT.md is readable")
}

/// The lines of the document's fenced block with this mark.
fn fenced<'d>(document: &'d str, mark: &str) -> Vec<&'d str> {
    let fence = format!("```{mark}");
    let lines: Vec<_> = document.lines().skip_while(|l| *l != fence).skip(1).take_while(|l| *l != "```").collect();
    assert!(!lines.is_empty(), "the document has a block marked {mark}");
    lines
}

/// The bytes of the hex example. A line is `offset: bytes # meaning`.
fn example(document: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    for line in fenced(document, "hex") {
        let (offset, rest) = line.split_once(':').expect("a line begins with its offset");
        assert_eq!(usize::from_str_radix(offset, 16), Ok(bytes.len()), "offset of {line:?}");
        let (hex, _) = rest.split_once('#').expect("a line has a comment");
        bytes.extend(hex.split_whitespace().map(|b| u8::from_str_radix(b, 16).expect("bytes are hexadecimal")));
    }
    bytes
}

const OBSERVATION: [f32; 2] = [2.5, 127.0];
const ACTION: [f32; 3] = [-40.0, 32.0, 40.0];
const LEVELS: [[i32; 2]; 3] = [[3, -1], [1, 1], [-3, 3]];
const SCALES: [f32; 3] = [0.5, 0.25, 0.125];
const BIAS: [f32; 3] = [0.5, -0.25, 1.125];

/// The example's policy, as the quantizer would pass it to the writer.
fn library_bytes() -> Vec<u8> {
    let mut graph = Graph::new(2);
    graph.matrices.push(WeightMatrix { name: "w".into(), rows: 3, cols: 2, data: vec![0.0; 6] });
    graph.add(Linear { matrix: 0, bias: BIAS.to_vec() }, &[0]).expect("it fits");
    let policy = Policy {
        contract: ActionContract { low: Some(vec![-40.0; 3]), high: Some(vec![40.0; 3]), ..ActionContract::default() },
        digest: std::array::from_fn(|i| i as u8),
        ..Policy::of("tiny", graph)
    };
    let quantized = Quantized {
        rows: 3,
        cols: 2,
        group: 0,
        widths: vec![Some(Width::W2); 3],
        scales: SCALES.map(bf16::from_f32).to_vec(),
        group_scales: Vec::new(),
        codes: LEVELS.as_flattened().iter().map(|&level| Width::W2.nearest_code(level as f32)).collect(),
    };
    let outcome = Outcome { quantized, error: None, x_max: 127, allocation: None };
    actq::emit::image(&policy, &[outcome]).expect("the policy fits the format")
}

fn floats(words: &[u32]) -> Vec<f32> {
    words.iter().map(|w| f32::from_bits(u32::from_le(*w))).collect()
}

#[test]
fn the_library_writes_the_hex_example() {
    let (documented, written) = (example(&document()), library_bytes());
    let words = |bytes: &[u8]| bytes.chunks(4).map(|w| format!("{w:02x?}")).collect::<Vec<_>>();
    assert_eq!(words(&documented), words(&written));
}

#[test]
fn the_hex_example_reads_as_documented() {
    let bytes = example(&document());
    let buffer = ImageBuffer::new(&bytes);
    let image = Image::new_checked(buffer.bytes()).expect("the example is a valid image");
    assert_eq!(image.bytes(), 252);
    assert_eq!(image.source_weights(), 6);
    assert_eq!(bytes[4 * h::W_CRC..][..4], checksum(&bytes).to_le_bytes());
    assert_eq!((image.kind(), image.chunk(), image.execute()), (Kind::Step, 1, 1));
    assert_eq!((image.obs_len(), image.act_len(), image.scratch_words()), (2, 3, 18));
    assert_eq!(image.state(), Region { offset: 0, len: 0 });
    assert_eq!(image.observation(), Region { offset: 0, len: 2 });
    assert_eq!(image.output(), Region { offset: 2, len: 3 });
    assert_eq!(image.action(), Region { offset: 5, len: 3 });
    assert_eq!(image.work(), Region { offset: 8, len: 10 });
    assert_eq!((image.rate_hz(), image.name()), (50.0, "tiny"));
    assert_eq!(image.digest(), std::array::from_fn(|i| i as u8));

    let [scale, offset, low, high, others @ ..] = image.contract_arrays();
    assert_eq!((floats(low), floats(high)), (vec![-40.0; 3], vec![40.0; 3]));
    assert!(scale.is_empty() && offset.is_empty() && others.iter().all(|array| array.is_empty()));

    assert_eq!(image.op_count(), 1);
    let op = image.ops().next().expect("the image has an operation");
    assert_eq!(op.kind, OpKind::Linear { accumulate: false, in_place: false });
    assert_eq!((op.src(), op.dst(), op.third()), (image.observation(), image.output(), image.work()));
    let matrix = op.matrix().expect("the operation is linear");
    assert_eq!((matrix.rows, matrix.cols, matrix.group, matrix.x_max), (3, 2, 0, 127));
    assert_eq!(max_prepared_words(matrix.cols, matrix.group, matrix.lanes()), image.work().len);
    let blocks: Vec<_> = matrix.blocks().collect();
    let [rows] = &blocks[..] else { panic!("the matrix has one block") };
    let shape = BlockShape { width: Width::W2, lanes: Lanes::Paired, rows: 3, cols: 2, group: 0 };
    assert_eq!(rows.block.shape(), shape);
    assert_eq!(matrix.weight_bytes(), block_bytes(shape, false));
    assert_eq!(rows.outputs().collect::<Vec<_>>(), [0, 1, 2]);
    for (i, levels) in LEVELS.iter().enumerate() {
        assert_eq!([rows.block.level(i, 0), rows.block.level(i, 1)], *levels, "row {i}");
        assert_eq!((rows.scale(i), matrix.bias(i)), (SCALES[i], BIAS[i]), "row {i}");
    }

    // The words that the text explains.
    for at in [0x80, 0x84] {
        let word = u32::from_le_bytes(bytes[at..at + 4].try_into().expect("a word has four bytes"));
        assert!(document().contains(&format!("0x{word:08x}: row ")), "{word:08x}");
    }

    assert_eq!(image.self_test_steps(), 1);
    let (observation, action) = image.self_test(0).expect("the step exists");
    let played = with_head::<_, anyhow::Error>(image, |head| Ok(head.step(&floats(observation))?.to_vec()));
    assert_eq!(played.expect("the observation is finite"), floats(action));
    assert!(image.self_test(1).is_none());
}

#[test]
fn the_hex_example_computes_the_documented_result() {
    let buffer = ImageBuffer::new(&example(&document()));
    let image = buffer.image(Path::new("docs/FORMAT.md")).expect("the example is a valid image");
    with_head::<_, anyhow::Error>(image, |head| {
        head.self_test()?;
        assert_eq!(head.infer(&OBSERVATION)?, [-60.0, 32.0, 48.0]);
        assert_eq!(head.step(&OBSERVATION)?, ACTION);
        Ok(())
    })
    .expect("the example runs");
}

/// The cells of the document's table that begins with `head`, row by row.
fn table<'d>(document: &'d str, head: &str) -> Vec<Vec<&'d str>> {
    let lines = document.lines().skip_while(|l| !l.starts_with(head)).skip(2).take_while(|l| l.starts_with('|'));
    let rows: Vec<_> = lines.map(|l| l.trim_matches('|').split('|').map(str::trim).collect()).collect();
    assert!(!rows.is_empty(), "the document has a table {head}");
    rows
}

fn number(cell: &str) -> usize {
    cell.parse().unwrap_or_else(|_| panic!("{cell:?} is not a number"))
}

fn width(cell: &str) -> Width {
    Width::from_bits(number(cell) as u32).expect("the width is known")
}

fn lanes(cell: &str) -> Lanes {
    match cell {
        "single" => Lanes::Single,
        "paired" => Lanes::Paired,
        "scalar" => Lanes::Scalar,
        "helium" => Lanes::Helium,
        _ => panic!("{cell:?} are no lanes"),
    }
}

/// The entries of a diagram's line, from bit 31 down: `-` is none, `7..0` a falling run, `3*8` eight times 3.
fn entries(line: &str) -> Vec<Option<usize>> {
    let one = |entry: &str| (entry != "-").then(|| number(entry));
    let several = |entry: &str| match (entry.split_once(".."), entry.split_once('*')) {
        (Some((first, last)), _) => (number(last)..=number(first)).rev().map(Some).collect(),
        (_, Some((entry, times))) => vec![one(entry); number(times)],
        _ => vec![one(entry)],
    };
    line.split_whitespace().flat_map(several).collect()
}

/// The position of a code's bit in a cell: a bit of a word, possibly the exclusive or with another one, possibly
/// inverted.
struct Place {
    at: (usize, usize),
    xor: Option<(usize, usize)>,
    inverted: bool,
}

/// A documented layout, from its table and its bit diagram.
struct Documented {
    width: Width,
    lanes: Lanes,
    strip: usize,
    cell_rows: usize,
    cell_cols: usize,
    cell_words: usize,
    /// Columns are padded to a multiple of this, without and with groups.
    pad: [usize; 2],
    /// The bits of a code, by row and column of the cell.
    places: Vec<Vec<Vec<Option<Place>>>>,
}

impl Documented {
    fn all(document: &str) -> Vec<Self> {
        let layouts: Vec<_> =
            table(document, "| lanes | width | rows of a strip |").iter().map(|row| Self::new(document, row)).collect();
        let kinds: Vec<_> = layouts.iter().map(|l| (l.lanes, l.width)).collect();
        let expected: Vec<_> = Lanes::ALL.into_iter().flat_map(|l| Width::ALL.map(|w| (l, w))).collect();
        assert_eq!(kinds, expected);
        layouts
    }

    fn new(document: &str, row: &[&str]) -> Self {
        let (width, lanes) = (width(row[1]), lanes(row[0]));
        let mark = if lanes == Lanes::Single { "" } else { row[0] };
        let lines = fenced(document, &format!("bits{}{mark}", width.bits()));
        // Lines of one label follow each other word by word.
        let entries = |label: &str| -> Vec<Vec<Option<usize>>> {
            lines.iter().filter_map(|l| l.strip_prefix(label).map(entries)).collect()
        };
        let of = |lines: &Vec<Vec<Option<usize>>>, word: usize, i: usize| lines.get(word).and_then(|l| l[i]);
        let [bits, rows, columns, code_bits, inverted, xor_words, xor_bits] =
            ["bit ", "row ", "column ", "code bit ", "inverted ", "xor word ", "xor bit "].map(entries);
        let [strip, cell_rows, cell_cols, cell_words, pad, group_pad] = [2, 3, 4, 5, 6, 7].map(|i| number(row[i]));
        let code = || (0..width.bits()).map(|_| None).collect::<Vec<_>>();
        let mut places: Vec<Vec<_>> = (0..cell_rows).map(|_| (0..cell_cols).map(|_| code()).collect()).collect();
        assert_eq!(bits, [(0..32).rev().map(Some).collect::<Vec<_>>()]);
        assert_eq!((columns.len(), code_bits.len()), (cell_words, cell_words));
        for word in 0..cell_words {
            assert_eq!((columns[word].len(), code_bits[word].len()), (32, 32));
            for i in 0..32 {
                let xor = of(&xor_words, word, i).zip(of(&xor_bits, word, i));
                let place = Place { at: (word, 31 - i), xor, inverted: of(&inverted, word, i) == Some(1) };
                let (row, column) = (of(&rows, word, i).unwrap_or(0), of(&columns, word, i).expect("a column"));
                let code_bit = of(&code_bits, word, i).expect("a bit of a code");
                let former = places[row][column][code_bit].replace(place);
                assert!(former.is_none(), "bit {code_bit} of ({row}, {column}) has two places");
            }
        }
        assert_eq!(cell_rows * cell_cols * width.bits() as usize, 32 * cell_words, "every bit of a code has a place");
        Self { width, lanes, strip, cell_rows, cell_cols, cell_words, pad: [pad, group_pad], places }
    }

    /// Reads a block as documented, and compares codes (with their padding) and group scales.
    fn check(&self, shape: BlockShape, codes: &[u8], scales: &[u8], packed: &[u32]) {
        let packed: Vec<u32> = packed.iter().map(|w| u32::from_le(*w)).collect();
        let padded_rows = shape.rows.next_multiple_of(4);
        let padded_cols = shape.cols.next_multiple_of(self.pad[usize::from(shape.group != 0)]);
        let group = if shape.group == 0 { padded_cols } else { shape.group };
        let groups = if shape.group == 0 { 0 } else { shape.cols.div_ceil(group) };
        // Units that are taken together.
        let units = if self.lanes == Lanes::Helium { 4 } else { 1 };
        let (mut next, mut together) = (0, 0..0);
        let mut first_row = 0;
        while first_row < padded_rows {
            let height = self.strip.min(padded_rows - first_row);
            let cells = height / self.cell_rows;
            for (unit, first_col) in (0..padded_cols).step_by(self.cell_cols).enumerate() {
                if unit.is_multiple_of(units) {
                    together = next..next + units * cells * self.cell_words;
                    next = together.end;
                }
                let place = |word, cell| units * (word * cells + cell) + unit % units;
                for (row, col) in (0..height).flat_map(|r| (0..self.cell_cols).map(move |c| (r, c))) {
                    let stored = |(word, bit): (usize, usize)| {
                        packed[together.clone()][place(word, row / self.cell_rows)] >> bit & 1
                    };
                    let places = self.places[row % self.cell_rows][col].iter().flatten();
                    let code: u32 = places
                        .enumerate()
                        .map(|(i, p)| (stored(p.at) ^ p.xor.map_or(0, stored) ^ u32::from(p.inverted)) << i)
                        .sum();
                    let (row, col) = (first_row + row, first_col + col);
                    let inside = row < shape.rows && col < shape.cols;
                    let expected = if inside { codes[row * shape.cols + col] } else { 0 };
                    assert_eq!(code, u32::from(expected), "{shape:?}, code at ({row}, {col})");
                }
                let end = first_col + self.cell_cols;
                if groups > 0 && (end.is_multiple_of(group) || end == padded_cols) {
                    let at = first_col / group;
                    let expected = |row: usize, at: usize| if row < shape.rows { scales[row * groups + at] } else { 0 };
                    let in_pairs = (self.width, self.lanes, height) == (Width::W2, Lanes::Paired, 8);
                    if in_pairs && at.is_multiple_of(2) && at + 1 < groups {
                        continue; // after the next group
                    }
                    let pair = in_pairs && !at.is_multiple_of(2);
                    for row in first_row..first_row + height {
                        let inside = row - first_row;
                        if pair {
                            let halves = packed[next + inside / 2].to_le_bytes();
                            let stored = [halves[inside % 2], halves[2 + inside % 2]];
                            assert_eq!(
                                stored,
                                [expected(row, at - 1), expected(row, at)],
                                "{shape:?}, scales of row {row}"
                            );
                        } else {
                            let word = packed[next + inside / 4];
                            assert_eq!(
                                (word >> (8 * (row % 4))) as u8,
                                expected(row, at),
                                "{shape:?}, scale of row {row}"
                            );
                        }
                    }
                    next += height / if pair { 2 } else { 4 };
                }
            }
            first_row += height;
        }
        assert_eq!(next, packed.len(), "{shape:?}");
    }
}

#[test]
fn layouts_and_bit_diagrams_match_the_packer() {
    let mut random = Random::new(1);
    for layout in Documented::all(&document()) {
        let mut shapes = 0;
        for (rows, cols, group) in [1, 3, 4, 5, 8, 9, 12, 13, 21].into_iter().flat_map(|rows| {
            let cols = [1, 2, 8, 31, 32, 33, 70, 128, 130];
            cols.into_iter().flat_map(move |cols| [0, 32, 64, 128].map(|group| (rows, cols, group)))
        }) {
            let shape = BlockShape { width: layout.width, lanes: layout.lanes, rows, cols, group };
            assert_eq!(shape.is_valid(), layout.lanes != Lanes::Paired || group <= 32);
            if !shape.is_valid() {
                continue;
            }
            let codes: Vec<u8> = (0..rows * cols).map(|_| random.byte() >> (8 - layout.width.bits())).collect();
            let scales = random.bytes(rows * shape.groups());
            let mut packed = vec![0; shape.words()];
            pack(shape, &codes, &scales, &mut packed).expect("the codes fit the shape");
            layout.check(shape, &codes, &scales, &packed);
            shapes += 1;
        }
        assert_eq!(shapes, if layout.lanes == Lanes::Paired { 162 } else { 324 });
    }
}

#[test]
fn lanes_follow_from_the_matrix_as_documented() {
    assert_eq!(Lanes::ALL.map(Lanes::code), [0, 1, 2, 3]);
    for (x_max, group) in [1, 126, 127, 128, 32767].into_iter().flat_map(|x| [0, 32, 64, 128].map(|g| (x, g))) {
        let expected = if x_max <= 127 && group <= 32 { Lanes::Paired } else { Lanes::Single };
        assert_eq!(Lanes::of(x_max, group), expected, "x_max {x_max}, group {group}");
    }
}

#[test]
fn the_table_of_levels_matches_the_codes() {
    let document = document();
    let rows = table(&document, "| width | level of a code |");
    assert_eq!(rows.len(), Width::ALL.len());
    for (row, expected) in rows.iter().zip(Width::ALL) {
        assert_eq!(width(row[0]), expected);
        let formula = row[1].split_once(':').expect("a formula and examples").0;
        for code in 0..1u32 << expected.bits() {
            let level = match formula.strip_prefix("2 code - ") {
                Some(offset) => 2 * code as i32 - number(offset) as i32,
                None => i32::from(code as u8 as i8),
            };
            assert_eq!(expected.level(code as u8), level, "{expected:?}, code {code}");
        }
    }
}

#[test]
fn the_table_of_sizes_matches_the_blocks() {
    let document = document();
    let layouts = Documented::all(&document);
    let rows = table(&document, "| rows | columns | width | lanes |");
    for row in &rows {
        let (width, lanes) = (width(row[2]), lanes(row[3]));
        let shape = BlockShape { width, lanes, rows: number(row[0]), cols: number(row[1]), group: number(row[4]) };
        assert!(shape.is_valid(), "{row:?}");
        let bytes = block_bytes(shape, row[5] == "yes");
        let bits_per_weight = bytes as f64 * 8.0 / (shape.rows * shape.cols) as f64;
        assert_eq!((number(row[6]), row[7]), (bytes, &*format!("{bits_per_weight:.9}")), "{row:?}");
        // The document's formula.
        let layout = layouts.iter().find(|l| (l.width, l.lanes) == (width, lanes)).expect("the layout is documented");
        let pad = layout.pad[usize::from(shape.group != 0)];
        let groups = if shape.group == 0 { 0 } else { shape.cols.div_ceil(shape.group) };
        let packed = 4 / layout.cell_rows * layout.cell_words * (shape.cols.div_ceil(pad) * pad / layout.cell_cols);
        let steps = if row[5] == "yes" { shape.rows.div_ceil(4) } else { 0 };
        assert_eq!(
            bytes,
            4 * (shape.rows.div_ceil(4) * (packed + groups) + shape.rows.div_ceil(2) + steps + 4),
            "{row:?}"
        );
    }
    assert_eq!(rows.len(), 15);
    // The text repeats these figures, wherever its lines break.
    let text = document.split_whitespace().collect::<Vec<_>>().join(" ");
    let example = "Example, 256 x 256 at 3 bits with paired lanes and one scale a row: 64 strips * 32 units * 3 words + \
                   128 words of scales + 4 words of record = 6276 words = 25104 bytes, \
                   which is 8 * 25104 / 65536 = 3.064453125 bits per weight.";
    assert!(text.contains(example));
}

#[test]
fn the_work_area_is_as_long_as_documented() {
    let document = document();
    let rows = table(&document, "| lanes | group | words of the work area");
    assert_eq!(
        rows,
        [
            ["1", "0", "1 + ceil(c / 8) * 5"],
            ["1", "0, where 8 does not divide c", "1 + ceil(c / 8) * 9"],
            ["1", "32", "ceil(c / 32) * 21"],
            ["1", "32, where 32 does not divide c", "max(ceil(c / 32) * 37, ceil(c / 64) * 67)"],
            ["1", "32, where 32 does but 64 does not", "max(ceil(c / 32) * 21, ceil(c / 64) * 67)"],
            ["0", "0", "1 + ceil(c / 32) * 16"],
            ["0", "0, where 32 does not divide c", "1 + ceil(c / 32) * 32"],
            ["0", "32, 64, 128", "ceil(c / group) * (group / 2 + 1)"],
            ["0", "32, 64, 128, where it does not divide c", "ceil(c / group) * (group + 1)"],
            ["3", "0", "1 + ceil(c / 32) * 8"],
            ["3", "32, 64, 128", "ceil(c / group) * (group / 4 + 1)"],
        ]
    );
    for cols in (1..1200usize).chain([4095, 4096, 65535]) {
        let divides = |unit: usize| cols.is_multiple_of(unit);
        let times = |unit: usize, words: usize| cols.div_ceil(unit) * words;
        for (lanes, group) in [Lanes::Paired, Lanes::Single, Lanes::Helium]
            .into_iter()
            .flat_map(|lanes| [0, 32, 64, 128].map(|group| (lanes, group)))
            .filter(|(lanes, group)| *lanes != Lanes::Paired || *group <= 32)
        {
            let words = match (lanes, group) {
                (Lanes::Paired, 0) => 1 + times(8, if divides(8) { 5 } else { 9 }),
                (Lanes::Paired, _) if divides(64) => times(32, 21),
                (Lanes::Paired, _) => times(64, 67).max(times(32, if divides(32) { 21 } else { 37 })),
                (Lanes::Single, 0) => 1 + times(32, if divides(32) { 16 } else { 32 }),
                (Lanes::Single, _) => times(group, if divides(group) { group / 2 + 1 } else { group + 1 }),
                (_, 0) => 1 + times(32, 8),
                (_, _) => times(group, group / 4 + 1),
            };
            let shape = |width| BlockShape { width, lanes, rows: 1, cols, group };
            let plans = Width::ALL.into_iter().filter_map(|width| Plan::new(shape(width)));
            let most = plans.map(|plan| plan.room(cols)).max();
            if lanes != Lanes::Helium {
                assert_eq!(
                    max_prepared_words(cols, group, lanes),
                    words,
                    "{cols} columns, groups of {group}, {lanes:?}"
                );
            }
            if lanes != Lanes::Paired || group == 0 || cols <= MAX_PAIRED_GROUPED {
                assert_eq!(most, Some(words), "{cols} columns, groups of {group}, {lanes:?}");
            }
        }
    }
}

#[test]
fn the_work_area_of_scalar_layouts_is_as_long_as_documented() {
    let document = document();
    let rows = table(&document, "| width | words that a block of scalar layout needs");
    assert_eq!(
        rows,
        [
            ["2, 3", "max(v + 128 * min(ceil(c / 8), 8), v + p / 2 if p > c)"],
            ["4", "v + 2 * ceil(p / 32), and p / 2 more if p > c"],
            ["8", "max(v + 4 * min(ceil(c / 8) * 4, 64), v + p / 2 if p > c)"],
        ]
    );
    for (cols, group) in (1..700usize).chain([4096, 65535]).flat_map(|cols| [0, 32, 64, 128].map(|group| (cols, group)))
    {
        let padded = |unit: usize| cols.next_multiple_of(unit);
        for width in Width::ALL {
            let unit = match (group, width) {
                (0, Width::W4) => 8,
                (0, _) => 32,
                _ => group,
            };
            let (p, v) = (padded(unit), padded(unit) / 2);
            let copy = if p > cols { p / 2 } else { 0 };
            let words = match width {
                Width::W2 | Width::W3 => (v + 128 * cols.div_ceil(8).min(8)).max(v + copy),
                Width::W4 => v + 2 * p.div_ceil(32) + copy,
                Width::W8 => (v + 4 * (cols.div_ceil(8) * 4).min(64)).max(v + copy),
            };
            let shape = BlockShape { width, lanes: Lanes::Scalar, rows: 1, cols, group };
            assert_eq!(Plan::new(shape).map(|plan| plan.work(cols)), Some(words), "{shape:?}");
        }
    }
}

#[test]
fn documented_versions_match_the_library() {
    let document = document();
    assert!(document.contains(&format!("This document describes version {}.", h::VERSION)));
    let layout = actq_kernels::layout::LAYOUT_STAMP;
    assert!(document.contains(&format!("| 4 | 16 | u32 layout stamp: {layout} |")));
}
