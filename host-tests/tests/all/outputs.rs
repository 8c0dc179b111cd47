//! The command's outputs: never over its inputs, through links, into devices and pipes, whole or not at all.
#![cfg(unix)]

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::Read as _;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use actq_bench::command::{actq, failed, run, succeeded};
use actq_bench::golden::Random;
use anyhow::{Result, ensure};
use ndarray::Array2;
use serde_json::json;
use tempfile::TempDir;

use crate::folder::{write_observations, write_policy};

const OBS: usize = 8;
const ACT: usize = 2;

/// A folder with a policy in `policy`, recordings `policy/calib.npz`, `policy/heldout.npz` and `drive.npz`, the image
/// `old.actq` and its statistics `old.json`; commands run in it.
struct Fixture(TempDir);

impl Fixture {
    fn new() -> Result<Self> {
        let fixture = Self(TempDir::new()?);
        fs::create_dir(fixture.path("policy"))?;
        let ops = [json!({"op": "linear", "w": "w"})];
        let json = json!({"name": "leg", "obs_dim": OBS, "act_dim": ACT, "ops": ops});
        let mut random = Random::new(3);
        let weights = (0..ACT * OBS).map(|_| random.unit()).collect();
        write_policy(&fixture.path("policy"), &json, [("w", vec![ACT, OBS], weights)])?;
        for name in ["policy/calib.npz", "policy/heldout.npz", "drive.npz"] {
            write_observations(&fixture.path(name), &Array2::from_shape_simple_fn((32, OBS), || random.unit()))?;
        }
        succeeded(&fixture.quantize("--out old.actq --save-stats old.json")?)?;
        Ok(fixture)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, line: &str) -> Command {
        let mut command = actq(&line.split_whitespace().collect::<Vec<_>>());
        command.current_dir(self.0.path());
        command
    }

    fn run(&self, line: &str) -> Result<Output> {
        run(self.command(line), b"")
    }

    fn quantize(&self, options: &str) -> Result<Output> {
        self.run(&format!("quantize policy --method rtn {options}"))
    }

    /// A new image, made in another way than the tested one.
    fn image(&self) -> Result<Vec<u8>> {
        Ok(fs::read(self.path("old.actq"))?)
    }
}

#[test]
fn writing_to_a_link_writes_its_target() -> Result<()> {
    let fixture = Fixture::new()?;
    fs::create_dir(fixture.path("images"))?;
    fs::write(fixture.path("images/there.actq"), "ACTQ old")?;
    // To an existing file, to a missing one, and through another link.
    for (link, to) in [("a", "images/there.actq"), ("b", "images/new.actq"), ("c", "b2"), ("b2", "images/third.actq")] {
        symlink(to, fixture.path(link))?;
    }
    for (out, target) in [("a", "there"), ("b", "new"), ("c", "third")] {
        succeeded(&fixture.quantize(&format!("--out {out}"))?)?;
        ensure!(fs::symlink_metadata(fixture.path(out))?.is_symlink(), "{out} is no longer a link");
        ensure!(fs::read(fixture.path(&format!("images/{target}.actq")))? == fixture.image()?, "{target}");
    }
    ensure!(fs::symlink_metadata(fixture.path("b2"))?.is_symlink(), "b2 is no longer a link");
    symlink("round", fixture.path("round"))?;
    failed(&fixture.quantize("--out round")?, 1, &["round: cannot write the file"])?;
    symlink("none/image.actq", fixture.path("lost"))?;
    failed(&fixture.quantize("--out lost")?, 1, &["lost: cannot write the file", "none"])
}

#[test]
fn images_replace_no_files_of_other_kinds() -> Result<()> {
    let fixture = Fixture::new()?;
    let out = fixture.path("train.py");
    fs::write(&out, "import torch\n")?;
    failed(
        &fixture.quantize("--out train.py")?,
        1,
        &["train.py: exists and is not an actq image; choose another name"],
    )?;
    ensure!(fs::read(&out)? == b"import torch\n", "the file was replaced");
    fs::write(&out, "")?;
    succeeded(&fixture.quantize("--out train.py")?)?;
    ensure!(fs::read(&out)? == fixture.image()?, "an empty file is replaced");
    Ok(())
}

#[test]
fn an_output_may_be_a_pipe() -> Result<()> {
    let fixture = Fixture::new()?;
    let pipe = fixture.path("pipe");
    ensure!(Command::new("mkfifo").arg(&pipe).status()?.success(), "no pipe");
    // Open for both, so that neither side waits for the other; the image is smaller than the pipe's buffer.
    let mut reader = OpenOptions::new().read(true).write(true).open(&pipe)?;
    succeeded(&fixture.quantize("--out pipe --save-stats stats.json")?)?;
    ensure!(fs::symlink_metadata(&pipe)?.file_type().is_fifo(), "the pipe was replaced");
    let mut image = vec![0; fixture.image()?.len()];
    reader.read_exact(&mut image)?;
    ensure!(image == fixture.image()? && fixture.path("stats.json").exists(), "another image");
    Ok(())
}

#[test]
fn an_output_may_be_a_device() -> Result<()> {
    let fixture = Fixture::new()?;
    // Through links: a user with the right to replace a device would lose it by the mistake that this test looks for.
    symlink("/dev/null", fixture.path("null"))?;
    symlink("/dev/stdout", fixture.path("stdout"))?;
    succeeded(&fixture.quantize("--out null")?)?;
    ensure!(fs::metadata(fixture.path("null"))?.file_type().is_char_device(), "the device was replaced");
    let output = fixture.quantize("--out stdout")?;
    let image = fixture.image()?;
    ensure!(output.status.success() && output.stdout == image, "standard output is not exactly the image");
    ensure!(String::from_utf8_lossy(&output.stderr).contains("weights"), "no report on standard error");
    let report = fixture.run("report old.actq --out stdout")?;
    let (page, said) = (String::from_utf8(report.stdout)?, String::from_utf8(report.stderr)?);
    ensure!(page.trim_end().ends_with("</html>") && !said.is_empty(), "{page} and {said}");
    // An open file already has a position at which others write.
    let log = fixture.path("log");
    fs::write(&log, "lines\n")?;
    let mut command = fixture.command("quantize policy --method rtn --out stdout");
    command.stdout(OpenOptions::new().append(true).open(&log)?).stderr(Stdio::piped());
    failed(&command.output()?, 1, &["stdout: cannot write the file", "it is a link to an open file"])?;
    ensure!(fs::read(&log)? == b"lines\n", "the file changed");
    Ok(())
}

fn mode(path: &Path) -> Result<u32> {
    Ok(fs::metadata(path)?.permissions().mode() & 0o7777)
}

#[test]
fn a_replaced_file_keeps_its_permissions() -> Result<()> {
    let fixture = Fixture::new()?;
    let out = fixture.path("image.actq");
    succeeded(&fixture.quantize("--out image.actq")?)?;
    File::create(fixture.path("new"))?;
    ensure!(mode(&out)? == mode(&fixture.path("new"))?, "{:o}: not the mode of a new file", mode(&out)?);
    for permissions in [0o600, 0o664, 0o4755] {
        fs::write(&out, "ACTQ old")?;
        fs::set_permissions(&out, Permissions::from_mode(permissions))?;
        succeeded(&fixture.quantize("--out image.actq")?)?;
        ensure!(mode(&out)? == permissions & 0o777, "{permissions:o} became {:o}", mode(&out)?);
        ensure!(fs::read(&out)? == fixture.image()?, "another image");
    }
    fs::write(&out, "ACTQ old")?;
    fs::set_permissions(&out, Permissions::from_mode(0o444))?;
    failed(
        &fixture.quantize("--out image.actq")?,
        1,
        &["image.actq: cannot write the file: the existing file is read-only"],
    )?;
    ensure!(fs::read(&out)? == b"ACTQ old", "a read-only file was replaced");
    Ok(())
}
