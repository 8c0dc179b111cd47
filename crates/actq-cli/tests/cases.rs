//! Command lines and what they answer, as the files `cases/*.txt`. `UPDATE_EXPECT=1` writes the answers anew.
//!
//! A case begins with `#` and its name, in a folder of its own ([`Folder`]). Lines change files or run the command (`$`);
//! answers are indented. A command that fails changes no file.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use actq::data::NpzWriter;
use actq_testkit::{Dtype, Random, TWO_JOINTS, onnx, safetensors, snapshot};
use anyhow::{Context as _, Result, bail, ensure};
use expect_test::expect_file;
use rayon::prelude::*;
use serde_json::Value;
use tempfile::TempDir;

/// A policy with every key that the cases change.
const POLICY: &str = r#"{"name": "tiny arm", "kind": "chunk", "chunk": 4, "execute": 2, "obs_dim": 40, "act_dim": 3, "control_hz": 25,
"action": {"scale": [0.5, 1.0, 2.0], "offset": [0.125, 0.0, -0.25], "low": [-0.75, -1.5, -2.5], "high": [0.8125, 1.5, 2.5]},
"ops": [{"op": "normalize", "mean": "norm.mean", "scale": "norm.scale", "clip": 5}, {"op": "linear", "w": "in.weight", "b": "in.bias"},
{"op": "tanh", "save": "h"}, {"op": "linear", "w": "mid.weight"}, {"op": "add", "with": "h"},
{"op": "linear", "w": "out.weight", "b": "out.bias"}]}"#;
const OBS: usize = 40;
const EPISODES: usize = 3;
const STEPS: usize = 20;

/// The folder of a case: `policy` with recordings, `out`, and the deploy bundle `bundle` with `raw.npz`.
struct Folder(TempDir);

impl Folder {
    fn new() -> Result<Self> {
        let folder = Self(TempDir::new()?);
        ["policy", "out", "bundle"].into_iter().try_for_each(|name| fs::create_dir(folder.path(name)))?;
        fs::write(folder.path("policy/policy.json"), POLICY)?;
        folder.write_tensors(None)?;
        folder.write_recording("policy/calib.npz", OBS, 0.5, [20, 7, 20])?;
        folder.write_recording("policy/heldout.npz", OBS, 0.25, [20, 7, 20])?;
        fs::write(folder.path("bundle/deploy.yaml"), TWO_JOINTS)?;
        fs::write(folder.path("bundle/policy.onnx"), onnx::linear(8, 2, &[]))?;
        let mut raw = NpzWriter::new(File::create(folder.path("raw.npz"))?);
        raw.array("joint_pos", &[12, 2], (0..24).map(|i| (0.7 * f64::from(i)).sin()))?;
        raw.finish()?;
        Ok(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes the policy's tensors, one of them replaced.
    fn write_tensors(&self, replaced: Option<(&str, Dtype, Vec<usize>, Vec<u8>)>) -> Result<()> {
        let mut random = Random::new(4);
        let shapes: [(&str, &[usize]); 7] = [
            ("norm.mean", &[OBS]),
            ("norm.scale", &[OBS]),
            ("in.weight", &[64, OBS]),
            ("in.bias", &[64]),
            ("mid.weight", &[64, 64]),
            ("out.weight", &[12, 64]),
            ("out.bias", &[12]),
        ];
        let mut tensors = BTreeMap::new();
        for (name, shape) in shapes {
            let values = (0..shape.iter().product()).flat_map(|_| (0.2 * random.unit()).to_le_bytes()).collect();
            tensors.insert(name, (Dtype::F32, shape.to_vec(), values));
        }
        if let Some((name, dtype, shape, bytes)) = replaced {
            tensors.insert(name, (dtype, shape, bytes));
        }
        let tensors = tensors.into_iter().map(|(name, (dtype, shape, bytes))| (name, dtype, shape, bytes));
        Ok(fs::write(self.path("policy/policy.safetensors"), safetensors(tensors))?)
    }

    /// Writes observations with a value in the first one, and the lengths of the episodes.
    fn write_recording(&self, name: &str, width: usize, value: f32, length: [i64; EPISODES]) -> Result<()> {
        let mut random = Random::new(5);
        let obs = (0..EPISODES * STEPS * width).map(|i| if i == 2 { value } else { 2.0 * random.unit() });
        let mut npz = NpzWriter::new(File::create(self.path(name))?);
        npz.array("obs", &[EPISODES, STEPS, width], obs.collect::<Vec<f32>>())?;
        npz.array("length", &[EPISODES], length)?;
        npz.finish()?;
        Ok(())
    }
}

#[test]
fn cases_have_the_answers_of_their_files() -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    files.sort();
    for path in files {
        let text = fs::read_to_string(&path)?;
        let cases: Vec<&str> = text.split("\n\n").collect();
        let answers = |case: &&str| answers(case).with_context(|| case.lines().next().unwrap_or_default().to_owned());
        let answered = cases.par_iter().map(answers).collect::<Result<Vec<_>>>()?;
        expect_file![path].assert_eq(&answered.join("\n"));
    }
    Ok(())
}

/// Runs a case, and returns its lines with the answers.
fn answers(case: &str) -> Result<String> {
    let folder = Folder::new()?;
    let mut text = String::new();
    for line in case.lines().filter(|line| !line.starts_with("    ")) {
        text += line;
        text.push('\n');
        match line.split_once(' ').unwrap_or((line, "")) {
            ("#", _) => {}
            ("$", words) => text += &answer(&folder, words).with_context(|| line.to_owned())?,
            (verb, rest) => change(&folder, verb, rest).with_context(|| line.to_owned())?,
        }
    }
    Ok(text)
}

/// Runs a command line. Returns its status and, if it fails, its output.
fn answer(folder: &Folder, words: &str) -> Result<String> {
    let words: Vec<&str> = words.split_whitespace().collect();
    let answer = || -> Result<(Option<i32>, String)> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_actq"));
        // The variables are those of the terminal that the test runs in.
        command.args(&words).current_dir(folder.0.path()).env_remove("COLUMNS").env_remove("ACTQ_POLICY");
        let output = command.stdin(Stdio::null()).output()?;
        let said = String::from_utf8([output.stdout, output.stderr].concat())?;
        ensure!(!said.contains("panicked") && !said.contains('\u{1b}'), "{said}");
        let said = said.replace(&folder.0.path().display().to_string(), "[folder]");
        let lines = said.lines().filter(|line| !line.starts_with("progress: "));
        let indented = |line: &str| format!("    {}\n", if line.is_empty() { "." } else { line.trim_end() });
        Ok((output.status.code(), lines.map(indented).collect()))
    };
    let before = snapshot(folder.0.path())?;
    let (status, said) = answer()?;
    if status == Some(0) {
        return Ok(String::new());
    }
    ensure!(snapshot(folder.0.path())? == before, "files changed");
    // An image that is in use stays, too.
    let is_new = |path: &PathBuf| !path.exists() && path.parent().is_some_and(Path::is_dir);
    let out = words.iter().position(|word| *word == "--out").and_then(|at| words.get(at + 1));
    let out = out.map(|name| folder.path(name)).filter(is_new);
    if let Some(image) = out.filter(|_| words[0] == "quantize" && !words.contains(&"--save-stats")) {
        fs::write(&image, "ACTQ: an image that is in use")?;
        let before = snapshot(folder.0.path())?;
        ensure!(
            answer()? == (status, said.clone()) && snapshot(folder.0.path())? == before,
            "another answer with an old image"
        );
        fs::remove_file(image)?;
    }
    Ok(format!("    status {}\n{said}", status.context("a signal ended the command")?))
}

/// Changes a file in the folder of a case.
fn change(folder: &Folder, verb: &str, rest: &str) -> Result<()> {
    let (name, rest) = rest.split_once(' ').unwrap_or((rest, ""));
    let (json, path) = (folder.path("policy/policy.json"), folder.path(name));
    let words: Vec<&str> = rest.split(' ').collect();
    match verb {
        "mkdir" => fs::create_dir(path)?,
        "hard-link" => fs::hard_link(folder.path(rest), path)?,
        "link" => std::os::unix::fs::symlink(rest, path)?,
        "write" => fs::write(path, rest.replace("\\n", "\n"))?,
        "remove" if path.is_dir() => fs::remove_dir_all(path)?,
        "remove" => fs::remove_file(path)?,
        "cut" => File::options().write(true).open(path)?.set_len(rest.parse()?)?,
        "move" => fs::rename(path, folder.path(rest))?,
        "replace" => {
            let (from, to) = rest.split_once(" => ").context("no =>")?;
            let (from, to, bytes) = (from.replace("\\n", "\n"), to.replace("\\n", "\n"), fs::read(&path)?);
            let mut places = bytes.windows(from.len()).enumerate().filter(|(_, part)| *part == from.as_bytes());
            let (at, _) = places.next().context("the file has no such text")?;
            fs::write(path, [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat())?;
        }
        // Sets a value of policy.json by its pointer, or adds a key.
        "policy" => {
            let mut policy: Value = serde_json::from_slice(&fs::read(&json)?)?;
            let value = serde_json::from_str(rest)?;
            if let Some(place) = policy.pointer_mut(name) {
                *place = value;
            } else {
                let (parent, key) = name.rsplit_once('/').context("no pointer")?;
                policy.pointer_mut(parent).context("policy.json lacks this place")?[key] = value;
            }
            fs::write(json, policy.to_string())?;
        }
        // Replaces a tensor: type, shape, the value of all elements, and that of the last one.
        "tensor" => {
            let [dtype, shape, all, last] = words[..] else { bail!("use NAME TYPE SHAPE VALUE LAST") };
            let shape = shape.split('x').map(|n| Ok(n.parse()?)).collect::<Result<Vec<usize>>>()?;
            let len: usize = shape.iter().product();
            let values = (1..=len).map(|i| Ok(if i == len { last } else { all }.parse::<f64>()?));
            let values = values.collect::<Result<Vec<f64>>>()?.into_iter();
            let (dtype, bytes): (_, Vec<u8>) = match dtype {
                "f32" => (Dtype::F32, values.flat_map(|value| (value as f32).to_le_bytes()).collect()),
                "f64" => (Dtype::F64, values.flat_map(f64::to_le_bytes).collect()),
                "i64" => (Dtype::I64, values.flat_map(|value| (value as i64).to_le_bytes()).collect()),
                _ => bail!("the type"),
            };
            folder.write_tensors(Some((name, dtype, shape, bytes)))?;
        }
        // Writes a recording: its width, a value of the first observation, and the length of the last episode.
        "recording" => {
            let [width, value, length] = words[..] else { bail!("use FILE WIDTH VALUE LENGTH") };
            folder.write_recording(name, width.parse()?, value.parse()?, [1, 1, length.parse()?])?;
        }
        _ => bail!("unknown change"),
    }
    Ok(())
}
