//! `actq import`, .onnx files in place of a policy folder, and the export from PyTorch.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use actq::data::{Element, write_npy};
use actq::import::Importer as _;
use actq::policy::Policy;
use actq_bench::command::{actq, binary, failed, succeeded};
use actq_bench::skipped;
use actq_onnx::{Onnx, proto};
use anyhow::{Result, ensure};
use ndarray::{Array, Array2, Array3, Dimension};
use tempfile::TempDir;

use super::file::{File, tensor};

const OBS: usize = 6;

fn text(path: &Path) -> &str {
    path.to_str().expect("a name")
}

fn write<D: Dimension>(path: &Path, array: &Array<impl Element, D>) -> Result<()> {
    Ok(write_npy(&mut fs::File::create(path)?, array.shape(), array.iter().copied())?)
}

/// A folder with `model.onnx` and `obs.npy`.
fn folder() -> Result<TempDir> {
    let dir = TempDir::new()?;
    let mut file = File::default();
    file.input("obs", &[1, OBS as i64]);
    file.write(&[], "actions := Identity(gemm(Tanh(gemm(obs, 24, 6)), 2, 24))");
    file.output("actions", &[1, 2]);
    fs::write(dir.path().join("model.onnx"), file.bytes())?;
    let obs = Array2::from_shape_fn((300, OBS), |(i, k)| ((7 * i + 3 * k) as f64 / 11.0).sin());
    write(&dir.path().join("obs.npy"), &obs)?;
    Ok(dir)
}

#[test]
fn import_writes_a_folder_and_overwrites_nothing() -> Result<()> {
    let dir = folder()?;
    let [model, obs, out] = ["model.onnx", "obs.npy", "policy"].map(|name| dir.path().join(name));
    let import = |more: &[&str]| actq(&[&["import", text(&model), "--out", text(&out)], more].concat()).output();
    let imported = import(&["--calib", text(&obs)])?;
    let printed = succeeded(&imported)?;
    let noted = String::from_utf8_lossy(&imported.stderr);
    ensure!(noted.contains("note: no finite limits for actions 0-1: "), "{noted}");
    for line in ["input     obs[0:6] = obs\n", "output    actions, 2 values\n", "ops       linear, tanh, linear\n"] {
        ensure!(printed.contains(line), "{printed}");
    }
    let mut written: Vec<String> = fs::read_dir(&out)?
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect::<Result<_>>()?;
    written.sort();
    assert_eq!(written, ["calib.npz", "policy.json", "policy.safetensors"]);
    failed(&import(&[])?, 1, &["policy.json: exists; pass --force to replace it"])?;
    succeeded(&import(&["--force"])?)?;
    // Frames with a batch axis look like episodes.
    let (rows, out) = (dir.path().join("rows.npy"), dir.path().join("rows"));
    write(&rows, &Array3::from_shape_fn((9, 1, OBS), |(i, _, k)| (i * k) as f32))?;
    let noted = actq(&["import", text(&model), "--out", text(&out), "--calib", text(&rows)]).output()?;
    let stderr = String::from_utf8_lossy(&noted.stderr);
    ensure!(
        stderr.contains("rows.npy holds 9 episodes of one step each; if they are one episode, save it as"),
        "{stderr}"
    );
    // The file replaces the folder, with the same digest.
    assert_eq!(Policy::load(&out)?.digest, Onnx.load(&model)?.digest);
    failed(
        &import(&["--force", "--output", "nothing"])?,
        1,
        &["--output nothing: the file has no value of this name; its outputs are actions"],
    )?;
    let lost = import(&["--force", "--state", "h=actions"])?;
    failed(&lost, 1, &["--state h=actions: the file has no input \"h\"; its inputs are obs"])?;
    let lost = import(&["--force", "--state", "obs=h"])?;
    failed(&lost, 1, &["--state obs=h: the file has no output \"h\"; its outputs are actions"])?;
    failed(&import(&["--force", "--state", "obs=actions"])?, 1, &["--state obs=actions: no cell between them"])?;
    // The output of the command makes an image.
    let image = dir.path().join("a.actq");
    let quantize = |more: &[&str]| actq(&[&["quantize", text(&model), "--out", text(&image)], more].concat()).output();
    failed(
        &quantize(&["--bpw", "3"])?,
        1,
        &["no calibration recording; pass one by --calib", "numpy.save(\"obs.npy\"", "(6 values)"],
    )?;
    succeeded(&quantize(&["--bpw", "3", "--calib", text(&obs), "--steps", "0"])?)?;
    succeeded(&quantize(&["--bits", "8", "--method", "rtn"])?)?;
    fs::rename(&obs, dir.path().join("heldout.npy"))?;
    let printed = succeeded(&actq(&["eval", text(&image), "--policy", text(&model)]).output()?)?;
    ensure!(printed.contains("observations   300"), "{printed}");
    Ok(())
}

/// Returns a Python with these modules, or skips the test.
#[track_caller]
fn python_with(modules: &str) -> Option<OsString> {
    let python = std::env::var_os("ACTQ_PYTHON").unwrap_or_else(|| "python3".into());
    let has = Command::new(&python).args(["-c", &format!("import {modules}")]).output();
    if has.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    skipped(&format!("no Python with {modules} (python3, or the one that ACTQ_PYTHON names)"));
    None
}

/// Runs `actq import --check` on a file with these initializers, the observation `obs`, and one layer of 20 values
/// before the last one.
fn checked(python: impl AsRef<OsStr>, initializers: &[proto::Tensor], layer: &str) -> Result<Output> {
    let dir = TempDir::new()?;
    let mut file = File::default();
    file.input("obs", &[1, OBS as i64]);
    initializers.iter().for_each(|tensor| file.initializer(tensor));
    file.write(&[], &format!("actions := Identity(gemm({layer}, 2, 20))"));
    file.output("actions", &[1, 2]);
    let [model, out] = ["model.onnx", "policy"].map(|name| dir.path().join(name));
    fs::write(&model, file.bytes())?;
    let import = ["import", text(&model), "--out", text(&out), "--check"];
    Ok(actq(&import).env("ACTQ_PYTHON", python).output()?)
}

#[test]
fn check_needs_a_python() -> Result<()> {
    let output = checked("no-such-python", &[], "gemm(obs, 20, 6)")?;
    failed(&output, 1, &["cannot run the file with onnxruntime for --check; set ACTQ_PYTHON"])
}

#[test]
fn check_finds_dequantized_weights_equal() -> Result<()> {
    let Some(python) = python_with("numpy, onnx, onnxruntime") else { return Ok(()) };
    // onnxruntime's optimizer would quantize the observations, too.
    let codes: Vec<u8> = (0..20 * OBS).map(|i| (37 * i % 255) as u8).collect();
    let [codes, zero] = [("q", &[OBS, 20][..], codes), ("z", &[], vec![0])].map(|(name, dims, codes)| proto::Tensor {
        data_type: Some(3),
        raw_data: Some(codes.into()),
        ..tensor(name, dims, &[])
    });
    let output = checked(python, &[codes, zero], "Tanh(MatMul(obs, DequantizeLinear(q, 0.01, z)))")?;
    let printed = succeeded(&output)?;
    ensure!(printed.contains("checked   256 observations against onnxruntime: off by"), "{printed}");
    Ok(())
}

#[test]
fn check_trusts_float64_over_onnxruntime() -> Result<()> {
    let Some(python) = python_with("numpy, onnx, onnxruntime") else { return Ok(()) };
    // In float32 the sigmoid is 0, and its logarithm infinite.
    let output = checked(python, &[], "Log(Sigmoid(gemm(obs, 20, 6) * 100.0))")?;
    let printed = succeeded(&output)?;
    ensure!(printed.contains("checked   256 observations against the file in float64: off by"), "{printed}");
    ensure!(printed.contains("by its float32 arithmetic"), "{printed}");
    Ok(())
}

#[test]
fn check_draws_around_the_files_own_means() -> Result<()> {
    let Some(python) = python_with("numpy, onnx, onnxruntime") else { return Ok(()) };
    // Physical units, limited after the normalization: no observation near 0 moves an action.
    let normalized = "gemm(Clip((obs - [101325.0, 300.0, 5000.0, 1000000.0, 900.0, 770.0]) * 0.02, -5.0, 5.0), 20, 6)";
    let printed = succeeded(&checked(&python, &[], normalized)?)?;
    ensure!(printed.contains("checked   512 observations against onnxruntime: off by"), "{printed}");
    ensure!(printed.contains("at most; actions 0-1 constant over the first 256\n"), "{printed}");
    Ok(())
}

#[test]
fn check_refuses_actions_that_stay_constant() -> Result<()> {
    let Some(python) = python_with("numpy, onnx, onnxruntime") else { return Ok(()) };
    let dead = "Relu(gemm(obs, 20, 6) - 1000.0)";
    failed(
        &checked(&python, &[], dead)?,
        1,
        &["the check shows nothing about actions 0-1, constant over 256 observations"],
    )
}

#[test]
fn check_runs_float64_without_onnxruntimes_kernel() -> Result<()> {
    let Some(python) = python_with("numpy, onnx, onnxruntime") else { return Ok(()) };
    let printed = succeeded(&checked(&python, &[], "Cast(Elu(Cast(gemm(obs, 20, 6), to=11)), to=1)")?)?;
    for part in ["256 observations against the file in float64: off by", "onnxruntime cannot run this file:", "Elu"] {
        ensure!(printed.contains(part), "{printed}");
    }
    Ok(())
}

#[test]
fn modules_of_pytorch_become_policies() -> Result<()> {
    let Some(python) = python_with("torch, onnx, onnxruntime") else { return Ok(()) };
    let script = actq_boards::root().join("examples/pytorch/test_actq_export.py");
    let output = Command::new(&python).arg(script).env("ACTQ", binary()?).env("ACTQ_PYTHON", &python).output()?;
    let printed = succeeded(&output)?;
    ensure!(printed.contains("5 modules"), "{printed}");
    Ok(())
}
