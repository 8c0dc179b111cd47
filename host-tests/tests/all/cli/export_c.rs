//! `actq export-c`: sources that strict compilers accept, and the bits in them.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Command;

use actq::runtime::ImageBuffer;
use actq_bench::bits;
use actq_bench::command::{actq, failed, run, succeeded};
use actq_kernels::Head;
use anyhow::{Result, ensure};
use ndarray::Array3;
use tempfile::TempDir;

use super::constants::{STRICT, compiles, has_compiler};
use super::fixture::text;
use crate::deployed::Made;
use crate::folder::write_observations;

/// Uses all that the files declare.
const USE: &str = "#include \"walker.h\"\n#include \"actq.h\"\nint main(void);\nint main(void) {\n\
                   return (walker_image[0] ^ walker_golden_actions[0]) == 0 && walker_golden_observations[0] > 0.0f \
                   && WALKER_GOLDEN_STEPS > 0 && sizeof(WALKER_SHA256) == 65;\n}\n";

/// Returns the numbers of an array in a source file.
fn numbers(source: &str, array: &str) -> Vec<u32> {
    let (_, rest) = source.split_once(&format!("{array}[")).expect("the array");
    let (_, rest) = rest.split_once('{').expect("its begin");
    let (list, _) = rest.split_once('}').expect("its end");
    let hexadecimal = |number: &str| number.trim().strip_prefix("0x")?.strip_suffix('u').map(str::to_owned);
    list.split(',').filter_map(hexadecimal).map(|n| u32::from_str_radix(&n, 16).expect("a number")).collect()
}

#[test]
fn exported_sources_have_the_hosts_image_and_actions() -> Result<()> {
    let dir = TempDir::new()?;
    let at = |name: &str| dir.path().join(name);
    let bytes = Made::deployment()?.1.four_bits()?;
    fs::write(at("made.actq"), &bytes)?;
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(&at("made.actq"))?;
    let raw: Vec<Vec<f64>> = Made::raw(9).iter().map(|raw| raw.concat()).collect();
    let observations = Array3::from_shape_fn((1, 9, image.obs_len()), |(_, i, k)| raw[i][k] as f32);
    write_observations(&at("runs.npz"), &observations)?;
    let [from, recording, out] = ["made.actq", "runs.npz", "new/folder"].map(|name| text(&at(name)));
    let options = ["--golden", &recording, "--steps", "5", "--name", "walker"];
    let exported = run(actq(&[&["export-c", &from, "--out", &out], &options[..]].concat()), b"")?;
    let printed = succeeded(&exported)?;
    ensure!(printed.lines().count() == 4 && printed.contains("walker_golden.c"), "{printed}");

    let read = |name: &str| fs::read_to_string(at("new/folder").join(name));
    let words: Vec<u8> = numbers(&read("walker.c")?, "walker_image").iter().flat_map(|w| w.to_le_bytes()).collect();
    ensure!(words == bytes, "the words of the image differ");
    let mut scratch = vec![0; image.scratch_words()];
    let mut head = Head::new(image, &mut scratch)?;
    let mut expected = Vec::new();
    for observation in observations.rows().into_iter().take(5) {
        expected.extend(bits(head.step(&observation.to_vec())?));
    }
    assert_eq!(numbers(&read("walker_golden.c")?, "walker_golden_actions"), expected);
    let manifest: serde_json::Value = serde_json::from_str(&read("walker.json")?)?;
    assert_eq!(manifest["image"]["crc32"], image.crc());
    assert_eq!(manifest["sha256"].as_object().map(serde_json::Map::len), Some(3));

    for (file, standard) in [("use.c", "-std=c99"), ("use.cpp", "-std=c++17")] {
        fs::write(at(file), USE)?;
        if !has_compiler(&at(file), standard)? {
            println!("not run: no compiler for {file}");
            continue;
        }
        let language = if file == "use.c" { "c" } else { "c++" };
        let include = actq_bench::root().join("capi/include");
        let sources = ["walker.c", "walker_golden.c"].map(|name| at("new/folder").join(name));
        let mut command = Command::new("cc");
        command.args([standard, "-x", language]).args(STRICT).arg("-I").arg(at("new/folder")).arg("-I").arg(&include);
        compiles(command.args(sources).arg(at(file)))?;
        if language == "c++" {
            fs::write(at("wrapper.cpp"), "#include \"actq.hpp\"\n")?;
            let mut command = Command::new("cc");
            compiles(command.arg(standard).args(STRICT).arg("-I").arg(&include).arg(at("wrapper.cpp")))?;
        }
    }
    // The golden run of this export would stay beside the files of the next one.
    let again = run(actq(&["export-c", &from, "--out", &out, "--name", "walker"]), b"")?;
    failed(&again, 1, &["walker_golden.c: it is of an earlier export; remove it, or pass --golden"])
}

/// Returns the names and the contents of a folder's files.
fn content(folder: &Path) -> Result<BTreeMap<OsString, Vec<u8>>> {
    fs::read_dir(folder)?
        .map(|entry| entry.and_then(|e| Ok((e.file_name(), fs::read(e.path())?))))
        .map(|e| Ok(e?))
        .collect()
}

/// A file that no export wrote stays, and no other file is written; --force replaces it.
#[test]
fn exports_replace_only_exported_files() -> Result<()> {
    let dir = TempDir::new()?;
    let at = |name: &str| dir.path().join(name);
    fs::write(at("made.actq"), Made::deployment()?.1.four_bits()?)?;
    let observations = Array3::from_elem((1, 2, 12), 0.5);
    write_observations(&at("runs.npz"), &observations)?;
    let [image, recording, out] = ["made.actq", "runs.npz", "out"].map(|name| text(&at(name)));
    let export = |name: &str, more: &[&str]| {
        let options = ["export-c", &image, "--out", &out, "--golden", &recording, "--name", name];
        run(actq(&[&options[..], more].concat()), b"")
    };
    succeeded(&export("walk", &[])?)?;
    let exported = content(&at("out"))?;
    let own: Vec<String> = exported.keys().map(|name| name.to_string_lossy().into_owned()).collect();
    ensure!(own == ["walk.c", "walk.h", "walk.json", "walk_golden.c"], "{own:?}");
    for name in &own {
        let line = fs::read_to_string(at("out").join(name))?.lines().next().unwrap_or_default().to_owned();
        let near = line.replace("made by", "once made by");
        for foreign in ["/* by hand */", "{\"mine\": 1}", "{}", &format!("\n{line}"), &near, "\u{0}"] {
            if foreign == line {
                continue;
            }
            fs::write(at("out").join(name), foreign)?;
            let before = content(&at("out"))?;
            failed(
                &export("walk", &[])?,
                1,
                &[&format!("{name}: already exists, and actq did not write it"), "--force"],
            )?;
            ensure!(content(&at("out"))? == before, "{name}: something was written");
        }
        succeeded(&export("walk", &["--force"])?)?;
        ensure!(content(&at("out"))? == exported, "{name} is not replaced");
        // An empty file, as mktemp makes it, and a file of an earlier export.
        fs::write(at("out").join(name), "")?;
        succeeded(&export("walk", &[])?)?;
        succeeded(&export("walk", &[])?)?;
    }
    // Policies with other names share the folder, each with its manifest.
    succeeded(&export("stand", &[])?)?;
    let both = content(&at("out"))?;
    ensure!(both.len() == 8 && exported.iter().all(|(name, bytes)| both.get(name) == Some(bytes)), "{:?}", both.keys());
    failed(&export("walk_golden", &[])?, 1, &["walk_golden.c: already exists, and actq did not write it"])
}
