//! A command that a signal ends leaves the old file or the whole new one, and nothing else.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use actq_bench::command::{actq, binary};
use anyhow::{Result, ensure};

use super::fixture::{Fixture, text};

/// Waits for a condition which shows that the command is at work.
fn wait_for(child: &mut Child, is_so: impl Fn() -> Result<bool>) -> Result<()> {
    while !is_so()? {
        ensure!(child.try_wait()?.is_none(), "the command ended too early");
        sleep(Duration::from_millis(5));
    }
    Ok(())
}

fn send(signal: &str, child: &Child) -> Result<()> {
    // A child that has just ended takes no signal, which is no error.
    Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).stderr(Stdio::null()).status()?;
    Ok(())
}

/// Signals while the quantizer learns. (Processes that a shell starts in the background, possibly these tests, ignore
/// SIGINT, and so would the command.)
#[cfg(target_os = "linux")]
#[test]
fn signals_leave_no_file_and_set_the_status() -> Result<()> {
    let fixture = Fixture::with_long_recording()?;
    let out = fixture.out("image.actq");
    fs::write(&out, "ACTQ: an image that is in use")?;
    let before = fixture.snapshot()?;
    for (signal, status) in [("HUP", 129), ("INT", 130), ("TERM", 143)] {
        let mut command = Command::new("env");
        command.args(["--default-signal=HUP,INT,TERM".as_ref(), binary()?.as_os_str()]);
        command.arg("quantize").arg(fixture.policy()).args(["--method", "distill", "--steps", "100000000", "--out"]);
        let mut child = command.arg(&out).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
        wait_for(&mut child, || Ok(fixture.snapshot()?.len() > before.len()))?;
        send(signal, &child)?;
        let output = child.wait_with_output()?;
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{signal}: {stderr}");
        ensure!(stderr.ends_with("actq: interrupted: no output was written\n"), "{stderr}");
        ensure!(fixture.snapshot()? == before, "files changed");
    }
    Ok(())
}

/// Runs `actq tune` in a folder of its own, also for its temporary files; the command of `--drive` creates the file
/// `started`.
fn start_tune(fixture: &Fixture, mut command: Command, drive: &str) -> Result<Child> {
    let folder = fixture.out("tune");
    fs::create_dir(&folder)?;
    command.arg("tune").arg(fixture.policy()).args(["--steps", "4", "--out", "image.actq", "--drive", drive]);
    command.current_dir(&folder).env("TMPDIR", &folder).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn()?;
    wait_for(&mut child, || Ok(folder.join("started").exists()))?;
    Ok(child)
}

fn names(folder: &Path) -> Result<Vec<String>> {
    let names = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
    names.collect()
}

#[test]
fn a_signal_ends_all_processes_of_the_drive() -> Result<()> {
    let fixture = Fixture::with_long_recording()?;
    let drive = "(sleep 60; touch survived) & touch started; wait";
    let child = start_tune(&fixture, actq(&[]), drive)?;
    send("TERM", &child)?;
    // This waits for every process that can still write to standard error: all processes of the drive.
    let output = child.wait_with_output()?;
    assert_eq!(output.status.code(), Some(143), "{output:?}");
    assert_eq!(names(&fixture.out("tune"))?, ["started"]);
    Ok(())
}

/// Like a robot's driver, which disarms it at the end.
#[test]
fn a_drive_may_handle_the_signal() -> Result<()> {
    let fixture = Fixture::with_long_recording()?;
    let drive = "trap 'touch disarmed; exit' TERM; touch started; while :; do sleep 0.01; done";
    let child = start_tune(&fixture, actq(&[]), drive)?;
    send("TERM", &child)?;
    let output = child.wait_with_output()?;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    ensure!(output.status.code() == Some(143) && fixture.out("tune/disarmed").exists(), "{stderr}");
    ensure!(!stderr.contains("has failed"), "the signal is not an error of the command: {stderr}");
    Ok(())
}

#[test]
fn a_second_signal_kills_the_drive() -> Result<()> {
    let fixture = Fixture::with_long_recording()?;
    let drive = "trap 'touch heard' TERM; touch started; while :; do sleep 0.01; done";
    let mut child = start_tune(&fixture, actq(&[]), drive)?;
    send("TERM", &child)?;
    wait_for(&mut child, || Ok(fixture.out("tune/heard").exists()))?;
    send("TERM", &child)?;
    assert_eq!(child.wait_with_output()?.status.code(), Some(143));
    Ok(())
}

#[cfg(target_os = "linux")]
#[test]
fn an_ignored_signal_stays_ignored() -> Result<()> {
    let fixture = Fixture::with_long_recording()?;
    let mut command = Command::new("env");
    command.args(["--ignore-signal=HUP".as_ref(), binary()?.as_os_str()]);
    let child = start_tune(&fixture, command, "touch started; while :; do sleep 0.01; done")?;
    send("HUP", &child)?;
    send("TERM", &child)?;
    assert_eq!(child.wait_with_output()?.status.code(), Some(143));
    Ok(())
}

/// Signals throughout the run of the command, including the write: the old image remains, or the whole new one.
#[test]
fn signals_at_any_time_leave_whole_images() -> Result<()> {
    const TRIES: u32 = 40;
    let fixture = Fixture::new()?;
    let out = fixture.out("image.actq");
    let (policy, file) = (text(&fixture.policy()), text(&out));
    let start = || {
        let mut command = actq(&["quantize", &policy, "--method", "rtn", "--out", &file]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()
    };
    // The first run may have to wait for the build of the command.
    ensure!(start()?.wait()?.success());
    let began = Instant::now();
    ensure!(start()?.wait()?.success());
    let (whole, time) = (fs::read(&out)?, began.elapsed());
    let mut in_time = 0;
    for i in 0..TRIES {
        fs::write(&out, "ACTQ old")?;
        let mut child = start()?;
        sleep(time * i / TRIES);
        send("TERM", &child)?;
        child.wait()?;
        let found = fs::read(&out)?;
        ensure!(found == b"ACTQ old" || found == whole, "{} bytes after signal {i}", found.len());
        assert_eq!(names(&fixture.out(""))?, ["image.actq"], "after signal {i}");
        in_time += u32::from(found != whole);
    }
    // The number depends on the machine.
    println!("{in_time} of {TRIES} signals came before the image was written");
    Ok(())
}
