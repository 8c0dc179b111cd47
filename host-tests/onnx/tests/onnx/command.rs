//! `actq import`, .onnx files in place of a policy folder, and the export from PyTorch.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use actq::data::{Element, write_npy};
use actq::import::Importer as _;
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq_bench::command::{actq, binary, failed, succeeded};
use actq_bench::skipped;
use actq_cli::importers::load;
use actq_onnx::{Onnx, proto};
use anyhow::{Result, ensure};
use ndarray::{Array, Array2, Array3, Dimension};
use tempfile::TempDir;

use super::file::{File, external, tensor};

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
    failed(&import(&[])?, 1, &["policy.json: already exists; use --force to overwrite"])?;
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

#[test]
fn quantize_says_what_it_takes_of_a_file() -> Result<()> {
    let dir = TempDir::new()?;
    let [model, image] = ["model.onnx", "image.actq"].map(|name| dir.path().join(name));
    let mut file = File::default();
    [("velocity", 2), ("unused", 1), ("position", 4), ("still", 1)]
        .iter()
        .for_each(|(name, n)| file.input(name, &[1, *n]));
    file.initializer(&tensor("w", &[1, 3], &[0.0; 3]));
    file.write(&[], "reaction_force := Identity(gemm(velocity, 2, 2))");
    file.write(&[], "action_mean := Tanh(Add(Add(gemm(velocity, 3, 2), gemm(position, 3, 4)), MatMul(still, w)))");
    file.write(&[], "discrete_action := ArgMax(action_mean)");
    [("discrete_action", 1), ("reaction_force", 2), ("action_mean", 3)]
        .iter()
        .for_each(|(name, n)| file.output(name, &[1, *n]));
    fs::write(&model, file.bytes())?;
    let made = actq(&["quantize", text(&model), "--method", "rtn", "--out", text(&image)]).output()?;
    let (printed, noted) = (succeeded(&made)?, String::from_utf8_lossy(&made.stderr));
    for line in [
        "input     obs[0:2] = velocity\n          obs[2:6] = position\n          obs[6:7] = still\n",
        "output    action_mean, 3 values\n",
        "cut       inputs unused: ",
        "cut       outputs discrete_action, reaction_force: ",
    ] {
        ensure!(printed.contains(line), "{line}: {printed}");
    }
    ensure!(
        noted.contains("note: output \"discrete_action\" is named action, too, and is left out, as it cannot be"),
        "{noted}"
    );
    ensure!(
        noted.contains("note: the policy states no control rate, and the image has 50 Hz, the default: "),
        "{noted}"
    );
    ensure!(noted.contains("note: no action of the network depends on the observation's value 6\n"), "{noted}");
    Ok(())
}

/// Writes a network that replaces NaN, then has one layer of 4 by 4 with its weights in another file, from `offset` on.
fn write_layer(model: &Path, [input, output]: [&str; 2], location: &str, offset: usize) -> Result<()> {
    let weights = external(&[4, 4], &[("location", location), ("offset", &offset.to_string())]);
    let mut file = File::default();
    file.input(input, &[1, 4]);
    file.initializer(&weights);
    file.write(&[], &format!("{output} := MatMul(Where(IsNaN({input}), 0.0, {input}), w)"));
    file.output(output, &[1, 4]);
    fs::create_dir_all(model.parent().expect("a folder"))?;
    Ok(fs::write(model, file.bytes())?)
}

/// Writes a bundle of two networks, each with its file and the place of its weights beside it.
fn write_bundle(folder: &Path, networks: [(&str, &str); 2]) -> Result<()> {
    let [first, second] = networks;
    write_layer(&folder.join(first.0), ["obs", "latent"], first.1, 0)?;
    write_layer(&folder.join(second.0), ["latent", "actions"], second.1, 64)?;
    for (i, (model, location)) in networks.into_iter().enumerate() {
        let data = folder.join(model).with_file_name("").join(location);
        fs::create_dir_all(data.parent().expect("a folder"))?;
        let weights = (0..32).flat_map(|k| ((7 * k + i) as f32 / 9.0).sin().to_le_bytes());
        fs::write(data, weights.collect::<Vec<u8>>())?;
    }
    let description = format!(
        "schema = 1\nname = \"t\"\nrate_hz = 50\naction = \"second.actions\"\n\
         [[input]]\nname = \"x\"\nlen = 4\n\
         [[network]]\nname = \"first\"\nfile = {:?}\ninputs = {{ obs = \"x\" }}\n\
         [[network]]\nname = \"second\"\nfile = {:?}\ninputs = {{ latent = \"first.latent\" }}\n\
         [[value]]\nname = \"target\"\nfrom = \"second.actions\"\n\
         [[target]]\nkind = \"position\"\nvalue = \"target\"\nlimits = [-20, 20]\n",
        first.0, second.0
    );
    Ok(fs::write(folder.join("deploy.toml"), description)?)
}

/// Lists the files below a folder, by their paths from it.
fn files_below(folder: &Path) -> Result<Vec<String>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        match path.is_dir() {
            true => files.extend(files_below(&path)?.into_iter().map(|inner| format!("{name}/{inner}"))),
            false => files.push(name),
        }
    }
    files.sort();
    Ok(files)
}

#[test]
fn an_imported_bundle_keeps_weights_of_other_files() -> Result<()> {
    for (networks, expected) in [
        // One folder of the bundle is the new folder, with its own folders.
        ([("a.onnx", "a.onnx.data"), ("b.onnx", "data/b.bin")], &["a.onnx", "a.onnx.data", "b.onnx", "data/b.bin"][..]),
        ([("nets/a.onnx", "w.bin"), ("nets/b.onnx", "./w.bin")], &["a.onnx", "b.onnx", "w.bin"]),
        // Files of one name keep their folders.
        (
            [("first/model.onnx", "w.bin"), ("second/model.onnx", "w.bin")],
            &["first/model.onnx", "first/w.bin", "second/model.onnx", "second/w.bin"],
        ),
        ([("a.onnx", "nets/w.bin"), ("nets/b.onnx", "w.bin")], &["a.onnx", "nets/b.onnx", "nets/w.bin"]),
    ] {
        let dir = TempDir::new()?;
        let [bundle, out, moved, image] = ["bundle", "out/policy", "moved", "a.actq"].map(|name| dir.path().join(name));
        fs::create_dir(&bundle)?;
        write_bundle(&bundle, networks)?;
        let observations = [vec![0.5, -1.0, 2.0, 0.25]];
        let expected_actions = actions(&load(&bundle)?, &observations);
        let imported = actq(&["import", text(&bundle), "--out", text(&out)]).output()?;
        succeeded(&imported)?;
        let noted = String::from_utf8_lossy(&imported.stderr);
        let guard = format!("{}: node 0 \"/node/0\" (IsNaN) replaces NaN by 0", networks[0].0);
        ensure!(noted.matches(&guard).count() == 1, "{noted}");
        fs::rename(&out, &moved)?;
        fs::remove_dir_all(&bundle)?;
        let mut expected_files = [expected, &["deploy.toml"]].concat();
        expected_files.sort_unstable();
        assert_eq!(files_below(&moved)?, expected_files, "{networks:?}");
        let policy = load(&moved)?;
        assert_eq!(actions(&policy, &observations), expected_actions);
        succeeded(
            &actq(&["quantize", text(&moved), "--bits", "8", "--method", "rtn", "--out", text(&image)]).output()?,
        )?;
        let weights = moved.join(expected.iter().find(|name| !name.ends_with("onnx")).expect("weights"));
        let mut changed = fs::read(&weights)?;
        changed[3] ^= 0x80;
        changed[67] ^= 0x80;
        fs::write(&weights, changed)?;
        ensure!(load(&moved)?.digest != policy.digest, "the digest ignores {}", weights.display());
    }
    Ok(())
}

#[test]
fn weights_outside_missing_or_short_are_refused() -> Result<()> {
    let dir = TempDir::new()?;
    let (bundle, out) = (dir.path().join("bundle"), dir.path().join("out"));
    fs::create_dir(&bundle)?;
    let import = || actq(&["import", text(&bundle), "--out", text(&out)]).output();
    write_bundle(&bundle, [("a.onnx", "a.bin"), ("b.onnx", "b.bin")])?;
    fs::write(bundle.join("b.bin"), [0; 100])?;
    failed(
        &import()?,
        1,
        &["the elements are 64 bytes at offset 64 of \"b.bin\", which has 100 bytes; copy the whole file"],
    )?;
    fs::remove_file(bundle.join("b.bin"))?;
    failed(
        &import()?,
        1,
        &["b.onnx", "cannot read \"b.bin\", which holds the elements (64 bytes); put it beside the model"],
    )?;
    fs::write(dir.path().join("b.bin"), [0; 128])?;
    write_layer(&bundle.join("b.onnx"), ["latent", "actions"], "../b.bin", 64)?;
    failed(&import()?, 1, &["the elements are in \"../b.bin\", outside the model's folder"])?;
    ensure!(!out.exists(), "nothing is written");
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

#[test]
fn check_runs_the_steps_of_a_sampler() -> Result<()> {
    let Some(python) = python_with("numpy, onnx, onnxruntime") else { return Ok(()) };
    let dir = TempDir::new()?;
    let [model, out, sampler] = ["model.onnx", "policy", "sampler.json"].map(|name| dir.path().join(name));
    fs::write(&model, super::denoiser::network())?;
    let diffusion = r#"{"kind": "diffusion", "train_steps": 20, "steps": 4, "schedule": "cosine", "solver": "ddpm",
        "prediction": "epsilon", "clip_sample": 1}"#;
    // Scales of actions are not the file's, so they are not compared.
    let flow = r#"{"kind": "flow", "steps": 5, "solver": "midpoint", "time": {"from": 1, "to": 0},
        "action": {"mean": [1, 2], "std": [3, 4]}}"#;
    for steps in [flow, diffusion] {
        fs::write(&sampler, steps)?;
        let import = ["import", text(&model), "--out", text(&out), "--force", "--check", "--sampler", text(&sampler)];
        let printed = succeeded(&actq(&import).env("ACTQ_PYTHON", &python).output()?)?;
        ensure!(printed.contains("checked   256 observations against onnxruntime: off by"), "{printed}");
    }
    Ok(())
}
