//! `docs/FORMAT.md` against the library: its hex example, its bit diagrams and its table of sizes.

use std::fs;
use std::path::Path;

use actq::graph::{Graph, Matrix, Node, NodeKind};
use actq::policy::{Contract, Policy};
use actq::quantize::{Outcome, Quantized};
use actq::runtime::{ImageBuffer, with_head};
use actq_host_tests::root;
use actq_kernels::format::{BlockShape, QUAD, Width, pack};
use actq_kernels::image::{Image, Kind, Op, Region, block_bytes, checksum, header as h};
use half::bf16;

fn document() -> String {
    fs::read_to_string(root().join("docs/FORMAT.md")).expect("docs/FORMAT.md can be read")
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
        let (offset, rest) = line.split_once(':').expect("a line starts with its offset");
        assert_eq!(usize::from_str_radix(offset, 16), Ok(bytes.len()), "offset of {line:?}");
        let (hex, _) = rest.split_once('#').expect("a line says what it means");
        bytes.extend(hex.split_whitespace().map(|b| u8::from_str_radix(b, 16).expect("bytes are hexadecimal")));
    }
    bytes
}

const OBSERVATION: [f32; 2] = [2.5, 127.0];
const ACTION: [f32; 3] = [-40.0, 32.0, 40.0];
const LEVELS: [[i32; 2]; 3] = [[3, -1], [1, 1], [-3, 3]];
const SCALES: [f32; 3] = [0.5, 0.25, 0.125];
const BIAS: [f32; 3] = [0.5, -0.25, 1.125];

/// The example's policy, as the quantizer would hand it to the writer.
fn library_bytes() -> Vec<u8> {
    let mut graph = Graph::new(2);
    graph.matrices.push(Matrix { name: "w".into(), rows: 3, cols: 2, data: vec![0.0; 6] });
    graph.nodes.push(Node { kind: NodeKind::Linear { matrix: 0, bias: BIAS.to_vec() }, input: 0, len: 3 });
    let policy = Policy {
        dir: ".".into(),
        name: "tiny".into(),
        kind: Kind::Step,
        chunk: 1,
        execute: 1,
        act_len: 3,
        rate_hz: 50.0,
        contract: Contract { low: Some(vec![-40.0; 3]), high: Some(vec![40.0; 3]), ..Contract::default() },
        graph,
        weights: 6,
        digest: std::array::from_fn(|i| i as u8),
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
    let outcome = Outcome { quantized, error: None, x_max: 127 };
    actq::writer::image(&policy, &[outcome]).expect("the policy fits the format")
}

fn floats(words: &[u32]) -> Vec<f32> {
    words.iter().map(|w| f32::from_bits(u32::from_le(*w))).collect()
}

#[test]
fn the_hex_example_is_what_the_library_writes() {
    let (documented, written) = (example(&document()), library_bytes());
    let words = |bytes: &[u8]| bytes.chunks(4).map(|w| format!("{w:02x?}")).collect::<Vec<_>>();
    assert_eq!(words(&documented), words(&written));
}

#[test]
fn the_hex_example_reads_as_documented() {
    let bytes = example(&document());
    let buffer = ImageBuffer::new(&bytes);
    let image = Image::new_checked(buffer.bytes()).expect("the example is a valid image");
    assert_eq!(image.bytes(), 300);
    assert_eq!(bytes[4 * h::W_CRC..][..4], checksum(&bytes).to_le_bytes());
    assert_eq!((image.kind(), image.chunk(), image.execute()), (Kind::Step, 1, 1));
    assert_eq!((image.obs_len(), image.act_len(), image.scratch_words()), (2, 3, 25));
    assert_eq!(image.state(), Region { offset: 0, len: 0 });
    assert_eq!(image.observation(), Region { offset: 0, len: 2 });
    assert_eq!(image.output(), Region { offset: 2, len: 3 });
    assert_eq!(image.action(), Region { offset: 5, len: 3 });
    assert_eq!(image.work(), Region { offset: 8, len: 17 });
    assert_eq!((image.rate_hz(), image.name()), (50.0, "tiny"));
    assert_eq!(image.digest(), std::array::from_fn(|i| i as u8));

    let contract = image.contract();
    assert_eq!((floats(contract.low), floats(contract.high)), (vec![-40.0; 3], vec![40.0; 3]));
    assert!(contract.scale.is_empty() && contract.offset.is_empty() && contract.max_step.is_empty());

    assert_eq!(image.op_count(), 1);
    let Some(Op::Linear { src, dst, matrix, accumulate: false }) = image.ops().next() else {
        panic!("the operation is linear")
    };
    assert_eq!((src, dst), (image.observation(), image.output()));
    assert_eq!((matrix.rows, matrix.cols, matrix.group, matrix.x_max), (3, 2, 0, 127));
    assert_eq!(matrix.prepared_words(), image.work().len);
    let blocks: Vec<_> = matrix.blocks().collect();
    let [rows] = &blocks[..] else { panic!("the matrix has one block") };
    let shape = BlockShape { width: Width::W2, rows: 3, cols: 2, group: 0 };
    assert_eq!(rows.block.shape(), shape);
    assert_eq!(matrix.weight_bytes(), block_bytes(shape, false));
    for (i, levels) in LEVELS.iter().enumerate() {
        assert_eq!([rows.block.level(i, 0), rows.block.level(i, 1)], *levels, "row {i}");
        assert_eq!((rows.scale(i), rows.output(i), matrix.bias(i)), (SCALES[i], i, BIAS[i]), "row {i}");
    }

    assert_eq!(image.self_test_steps(), 3);
    for step in 0..3 {
        let (observation, action) = image.self_test(step).expect("the step exists");
        let played = with_head(image, |head| Ok(head.step(&floats(observation))?.to_vec()));
        assert_eq!(played.expect("the observation is finite"), floats(action));
    }
    assert!(image.self_test(3).is_none());
}

#[test]
fn the_hex_example_computes_what_is_worked_out_by_hand() {
    let buffer = ImageBuffer::new(&example(&document()));
    let image = buffer.image(Path::new("docs/FORMAT.md")).expect("the example is a valid image");
    with_head(image, |head| {
        head.self_test()?;
        assert_eq!(head.infer(&OBSERVATION)?, [-60.0, 32.0, 48.0]);
        assert_eq!(head.step(&OBSERVATION)?, ACTION);
        Ok(())
    })
    .expect("the example runs");
}

#[test]
fn the_bit_diagrams_show_where_codes_stand() {
    let document = document();
    for width in Width::ALL {
        let lines = fenced(&document, &format!("bits{}", width.bits()));
        // The numbers of a line, from bit 31 down; lines of one kind follow each other word by word.
        let numbers = |label: &str| -> Vec<Vec<usize>> {
            let values = |l: &&str| Some(l.strip_prefix(label)?.split_whitespace().map(str::parse).collect());
            let lines: Result<_, _> = lines.iter().filter_map(values).collect();
            lines.expect("a diagram holds numbers")
        };
        let (columns, code_bits) = (numbers("column "), numbers("code bit "));
        let cols = columns.len() * 32 / width.bits() as usize;
        let shape = BlockShape { width, rows: 1, cols, group: 0 };
        assert_eq!(shape.words(), QUAD * columns.len(), "the diagram shows one unit");
        let mut seen = 0;
        for (word, (columns, code_bits)) in columns.iter().zip(&code_bits).enumerate() {
            assert_eq!((columns.len(), code_bits.len()), (32, 32));
            for (i, (&column, &code_bit)) in columns.iter().zip(code_bits).enumerate() {
                let mut codes = vec![0u8; cols];
                codes[column] = 1 << code_bit;
                let mut packed = vec![0; shape.words()];
                pack(shape, &codes, &[], &mut packed).expect("the codes fit the shape");
                let mut expected = vec![0; shape.words()];
                expected[word * QUAD] = (1u32 << (31 - i)).to_le();
                assert_eq!(packed, expected, "{width:?}, bit {code_bit} of column {column}");
                seen += 1;
            }
        }
        assert_eq!(seen, cols * width.bits() as usize);
    }
}

#[test]
fn the_table_of_sizes_is_what_blocks_take() {
    let document = document();
    let table = document.lines().skip_while(|l| !l.starts_with("| rows | columns | width |")).skip(2);
    let mut rows = 0;
    for line in table.take_while(|l| l.starts_with('|')) {
        let cells: Vec<_> = line.trim_matches('|').split('|').map(str::trim).collect();
        let number = |i: usize| cells[i].parse::<usize>().expect("a cell holds a number");
        let width = Width::from_bits(number(2) as u32).expect("the width is known");
        let shape = BlockShape { width, rows: number(0), cols: number(1), group: number(3) };
        let bytes = block_bytes(shape, cells[4] == "yes");
        let bits_per_weight = bytes as f64 * 8.0 / (shape.rows * shape.cols) as f64;
        assert_eq!((number(5), cells[6]), (bytes, &*format!("{bits_per_weight:.9}")), "{line}");
        rows += 1;
    }
    assert_eq!(rows, 7);
    // The same figures where the text works them out, wherever its lines break.
    let text = document.split_whitespace().collect::<Vec<_>>().join(" ");
    let example = "64 quads * 96 words + 128 words of scales + 4 words of record = 6276 words = 25104 bytes, \
                   which is 8 * 25104 / 65536 = 3.064453125 bits per weight.";
    assert!(text.contains(example));
}

#[test]
fn versions_in_the_text_are_those_of_the_library() {
    let document = document();
    assert!(document.contains(&format!("This document describes version {}.", h::VERSION)));
    let layout = actq_kernels::format::LAYOUT_STAMP;
    assert!(document.contains(&format!("| 4 | 16 | u32 layout stamp: {layout} |")));
}
