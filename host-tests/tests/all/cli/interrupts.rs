//! A command that is ended from outside leaves the old file, or the whole new one.
#![cfg(unix)]

use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use actq_bench::command::actq;
use actq_bench::golden::Random;
use anyhow::{Result, ensure};
use ndarray::Array3;

use super::fixture::{Fixture, OBS, text, write_npy};

/// Ctrl-C while the quantizer learns.
#[test]
fn an_interrupt_leaves_no_file() -> Result<()> {
    let fixture = Fixture::new()?;
    let random = &mut Random::new(8);
    let obs = Array3::from_shape_simple_fn((1, 300, OBS), || 2.0 * random.unit());
    fs::remove_file(fixture.policy().join("calib.npz"))?;
    write_npy(&fixture.policy().join("calib.npy"), &obs)?;
    let out = fixture.out("image.actq");
    fs::write(&out, "an image that is in use")?;
    let before = fixture.snapshot()?;
    let policy = text(&fixture.policy());
    let mut command = actq(&["quantize", &policy, "--method", "best", "--steps", "100000000", "--out", &text(&out)]);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
    sleep(Duration::from_secs(1));
    ensure!(child.try_wait()?.is_none(), "the command has ended by itself");
    interrupt(&child)?;
    let output = child.wait_with_output()?;
    assert_eq!(output.status.signal(), Some(15), "{output:?}");
    ensure!(fixture.snapshot()? == before, "files have changed");
    Ok(())
}

fn interrupt(child: &Child) -> Result<()> {
    // SIGTERM ends the command as Ctrl-C does: it has a handler for neither. SIGINT is ignored by all that a shell
    // starts in the background, tests and their children among it. A child that has just ended cannot be interrupted,
    // which is no error.
    Command::new("kill").args(["-TERM", &child.id().to_string()]).stderr(Stdio::null()).status()?;
    Ok(())
}

/// Interrupts all over the time that the command takes, the writing among it: the old image is there, or the whole new
/// one.
#[test]
fn an_interrupt_at_any_time_leaves_a_whole_image() -> Result<()> {
    const TRIES: u32 = 40;
    let fixture = Fixture::new()?;
    let out = fixture.out("image.actq");
    let (policy, file) = (text(&fixture.policy()), text(&out));
    let start = || {
        let mut command = actq(&["quantize", &policy, "--method", "rtn", "--out", &file]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()
    };
    // The first one may have to wait for the command to be built.
    ensure!(start()?.wait()?.success());
    let began = Instant::now();
    ensure!(start()?.wait()?.success());
    let (whole, time) = (fs::read(&out)?, began.elapsed());
    let mut seen = [0; 2];
    for i in 0..TRIES {
        fs::write(&out, "old")?;
        let mut child = start()?;
        sleep(time * i / TRIES);
        interrupt(&child)?;
        child.wait()?;
        let found = fs::read(&out)?;
        ensure!(found == b"old" || found == whole, "{} bytes after interrupt {i}", found.len());
        seen[usize::from(found == whole)] += 1;
    }
    ensure!(seen[0] > 0, "no interrupt came in time: {seen:?}");
    Ok(())
}
