//! `actq import`

use std::env;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use actq::data::{Dataset, Recording, Sizes};
use actq::emit::files;
use actq::import::FILES;
use actq::import::onnx::{Choice, Imported, import};
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq::random::Random;
use actq::report::{imported, notes};
use anyhow::{Context as _, Result, bail, ensure};

use crate::args::ImportArgs;
use crate::terminal::{note, print};

/// Observations that the check draws, and takes of a recording.
const FRAMES: usize = 256;
/// How far our actions may be from the file's, in shares of the largest.
const TOLERANCE: f32 = 1e-5;

/// Makes a policy's folder of an ONNX file and says what became of it.
pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    let choice = Choice { output: args.output.clone(), states: args.state.clone() };
    let imported = import(&args.model, &choice)?;
    let [json, weights] = FILES.map(|name| args.out.join(name));
    let policy = Policy::of_files(&args.out, [&args.model, &args.model], &imported.json, &imported.weights)?;
    let calib = args.calib.as_ref().map(|path| Dataset::load(path, Sizes::of(&policy))).transpose()?;
    note(calib.as_ref().and_then(notes::single_steps));
    let [calib_npz, others @ ..] = Recording::Calib.paths(&args.out);
    ensure!(
        args.out.is_dir() || !args.out.exists(),
        "{}: is there already and no folder; --out names the folder that is made",
        args.out.display()
    );
    for path in [&json, &weights].into_iter().chain(calib.is_some().then_some(&calib_npz)) {
        ensure!(args.force || !path.exists(), "{}: is there already; --force replaces it", path.display());
    }
    let other = others.iter().find(|path| calib.is_some() && path.exists());
    ensure!(
        other.is_none(),
        "{}: is there already, and one recording can be",
        other.map_or("".into(), |p| p.display().to_string())
    );
    let checked = match args.check {
        true => Some(check(&args.model, &imported, &policy, calib.as_ref())?),
        false => None,
    };
    fs::create_dir_all(&args.out).with_context(|| format!("{}: cannot be made", args.out.display()))?;
    let mut written = vec![(json.as_path(), imported.json.clone()), (weights.as_path(), imported.weights.clone())];
    if let Some(calib) = &calib {
        written.push((calib_npz.as_path(), calib.npz()?));
    }
    let inputs: Vec<_> = [Some(args.model.clone()), args.calib.clone()].into_iter().flatten().collect();
    files::check_outputs(&written.iter().map(|(path, _)| *path).collect::<Vec<_>>(), &inputs)?;
    files::write_all(&written)?;
    print(&imported::summary(&imported, &policy))?;
    if let Some((frames, error)) = checked {
        print(&format!(
            "checked   {frames} observations against onnxruntime: off by {error:.1e} of the largest action at most\n"
        ))?;
    }
    print(&format!(
        "written   {}\n",
        written.iter().map(|(path, _)| path.display().to_string()).collect::<Vec<_>>().join(", ")
    ))
}

/// Runs the file by onnxruntime and the policy by this program's f32 interpreter; gives the frames, and how far they
/// are apart.
fn check(model: &Path, imported: &Imported, policy: &Policy, calib: Option<&Dataset>) -> Result<(usize, f32)> {
    let observations: Vec<Vec<f32>> = match calib {
        Some(calib) => calib.episode(0).take(FRAMES).collect(),
        None => {
            let mut random = Random::new(1);
            // What the file takes as integers is drawn so.
            let whole = |(name, len): &(String, usize)| vec![imported.integers.contains(name); *len];
            let whole: Vec<bool> = imported.inputs.iter().flat_map(whole).collect();
            let mut value = |whole: &bool| {
                let value = 2.0 * random.unit();
                if *whole { (100.0 * value).round() } else { value }
            };
            (0..FRAMES).map(|_| whole.iter().map(&mut value).collect()).collect()
        }
    };
    let states: Vec<[&str; 2]> = imported.states.iter().map(|(from, to, _)| [from.as_str(), to]).collect();
    let plan = serde_json::json!({ "inputs": imported.inputs, "states": states, "output": imported.output.0 });
    let python = env::var_os("ACTQ_PYTHON").unwrap_or_else(|| "python3".into());
    let starts = "--check runs the file with onnxruntime, from Python (python3, or what ACTQ_PYTHON names)";
    let mut child = Command::new(python)
        .args(["-c", include_str!("check.py")])
        .arg(model)
        .arg(plan.to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context(starts)?;
    let bytes: Vec<u8> = observations.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    // It may have ended without reading; then its message says why.
    let _ = child.stdin.take().context("it has an input")?.write_all(&bytes);
    let output = child.wait_with_output().context(starts)?;
    if !output.status.success() {
        bail!("{starts}: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    let expected: Vec<f32> = output.stdout.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let ours = actions(policy, &observations).concat();
    ensure!(expected.len() == ours.len(), "onnxruntime gives {} values, {} are ours", expected.len(), ours.len());
    let scale = expected.iter().fold(0f32, |most, v| most.max(v.abs()));
    let error =
        expected.iter().zip(&ours).fold(0f32, |most, (a, b)| most.max((a - b).abs())) / scale.max(f32::MIN_POSITIVE);
    let finite = expected.iter().chain(&ours).all(|v| v.is_finite());
    ensure!(
        finite && error <= TOLERANCE,
        "{}: the policy and the file differ by {error:.1e} of the largest action; this is an error of this program, please report it",
        model.display()
    );
    Ok((observations.len(), error))
}
