//! An image as source code of C: the words, their numbers, and a golden run.

use std::fmt::Write as _;

use actq::measure::size::hex;
use actq_kernels::Image;
use anyhow::Result;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::constants::{Language, comment, quoted, source};

/// Numbers in a line.
const PER_LINE: usize = 8;

/// A run of the image on this host.
pub struct Golden {
    /// The observations, one after the other.
    pub observations: Vec<f32>,
    /// Bits of the actions, one after the other.
    pub actions: Vec<u32>,
}

/// The files of an export, by name.
pub type Files = Vec<(String, String)>;

/// Returns the files for an image of these `bytes`; names in them begin with `name`, an identifier of C.
///
/// # Errors
///
/// If two constants would have the same name.
pub fn files(image: &Image<'_>, bytes: &[u8], name: &str, golden: Option<&Golden>) -> Result<Files> {
    let mut files = vec![
        (format!("{name}.h"), header(image, bytes, name, golden)?),
        (format!("{name}.c"), words(image, bytes, name)),
    ];
    files.extend(golden.map(|golden| (format!("{name}_golden.c"), run(name, golden))));
    let manifest = manifest(image, bytes, &files);
    files.push((format!("{name}.json"), format!("{manifest:#}\n")));
    Ok(files)
}

fn header(image: &Image<'_>, bytes: &[u8], name: &str, golden: Option<&Golden>) -> Result<String> {
    let (capitals, words) = (name.to_uppercase(), bytes.len() / 4);
    let mut more = format!(
        "/* SHA-256 of the image, and of the policy it was made from. */\n#define {capitals}_SHA256 \"{}\"\n\
         #define {capitals}_SOURCE_SHA256 \"{}\"\n\n#include <stdint.h>\n\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n\
         /* The image: pass it and {capitals}_IMAGE_BYTES to actq_image_open or actq_image_open_checksummed. */\nextern const uint32_t {name}_image[{words}];\n",
        sha256(bytes),
        hex(&image.digest())
    );
    if let Some(golden) = golden {
        let steps = golden.actions.len() / image.act_len().max(1);
        let _ = write!(
            more,
            "\n/* A run on the host from a reset: the observations, and the bits of the actions. */\n\
             #define {capitals}_GOLDEN_STEPS {steps}u\nextern const float {name}_golden_observations[{}];\n\
             extern const uint32_t {name}_golden_actions[{}];\n",
            golden.observations.len(),
            golden.actions.len()
        );
    }
    more += "\n#ifdef __cplusplus\n}\n#endif\n";
    // Before the end of the include guard.
    let constants = source(Language::C, image, name, None)?;
    Ok(match constants.rsplit_once("\n#endif") {
        Some((before, after)) => format!("{before}{more}\n#endif{after}"),
        None => constants + &more,
    })
}

fn words(image: &Image<'_>, bytes: &[u8], name: &str) -> String {
    let policy = comment(&quoted(image.name()));
    let words = bytes.chunks_exact(4).map(|word| {
        let word = word.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
        format!("{word:#010x}u")
    });
    format!(
        "/* The image of {policy}, made by `actq export-c`. Do not edit. A word is 4 bytes, the lowest first. */\n\
         #include \"{name}.h\"\n\n/* Where the linker puts it, for GNU-compatible compilers: in flash, at a multiple of 8. */\n\
         #if defined(__GNUC__) && defined(__ELF__)\n__attribute__((section(\".rodata.{name}_image\"), aligned(8)))\n#endif\n{}",
        array("uint32_t", &format!("{name}_image"), words)
    )
}

fn run(name: &str, golden: &Golden) -> String {
    format!(
        "/* A run of the image on the host, made by `actq export-c`. Do not edit. */\n#include \"{name}.h\"\n\n{}\n{}",
        array("float", &format!("{name}_golden_observations"), golden.observations.iter().map(|v| format!("{v:?}f"))),
        array("uint32_t", &format!("{name}_golden_actions"), golden.actions.iter().map(|v| format!("{v:#010x}u")))
    )
}

/// Returns the definition of an array.
fn array(of: &str, name: &str, values: impl Iterator<Item = String>) -> String {
    let values: Vec<String> = values.collect();
    let lines: Vec<String> = values.chunks(PER_LINE).map(|line| format!("    {}", line.join(", "))).collect();
    format!("const {of} {name}[{}] = {{\n{}\n}};\n", values.len(), lines.join(",\n"))
}

fn manifest(image: &Image<'_>, bytes: &[u8], files: &Files) -> Value {
    let digests: serde_json::Map<_, _> =
        files.iter().map(|(name, text)| (name.clone(), sha256(text.as_bytes()).into())).collect();
    json!({
        "schema": 1,
        "actq": env!("CARGO_PKG_VERSION"),
        "policy": image.name(),
        "image": {
            "bytes": bytes.len(),
            "crc32": image.crc(),
            "sha256": sha256(bytes),
            "source_sha256": hex(&image.digest()),
            "scratch_bytes": 4 * (image.scratch_words() + 1),
        },
        "sha256": digests,
        "not_measured": ["time, stack and power on a real board"],
    })
}

/// Returns the SHA-256 of bytes, as hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}
