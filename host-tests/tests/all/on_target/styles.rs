//! The head in user firmware, in each style of `firmware/styles`, under QEMU.

use std::fs;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use actq::runtime::ImageBuffer;
use actq_bench::controller::HANG_TIMEOUT;
use actq_bench::firmware::{self, STYLE_NAMES, built_in};
use actq_bench::{qemu, root};
use anyhow::{Context, Result, ensure};

/// The motors' first action has the host's bits, and control ticks have come while the head ran: a step of 377 thousand
/// instructions, of 32 ns each in QEMU here, and a tick each millisecond.
#[test]
fn every_style_matches_the_host_below_its_tick() -> Result<()> {
    let buffer = ImageBuffer::read(built_in()?)?;
    let (_, expected) = buffer.image(built_in()?)?.self_test(0).context("the image has no self-test")?;
    let expected: Vec<String> = expected.iter().map(|word| format!("{:08x}", u32::from_le(*word))).collect();
    for name in STYLE_NAMES {
        let mut command = qemu::command(&firmware::style(name)?, None, "")?;
        command.args(["-icount", "shift=5"]);
        let output = qemu::run(command, &[])?;
        let text = String::from_utf8_lossy(&output.stdout);
        ensure!(output.status.success(), "{name}: {text} {}", String::from_utf8_lossy(&output.stderr));
        let (ticks, action) = text.split_once(' ').context("the output has no action")?;
        assert_eq!(action, expected.join(" "), "{name}");
        assert!((10..20).contains(&ticks.parse::<u32>()?), "{name}: {ticks} ticks in a step");
    }
    Ok(())
}

/// Lines that are neither empty nor a comment.
#[test]
fn every_style_has_at_most_sixty_lines() -> Result<()> {
    for name in STYLE_NAMES {
        let source = fs::read_to_string(root().join(format!("firmware/styles/src/bin/{name}.rs")))?;
        let lines = source.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")).count();
        assert!((30..=60).contains(&lines), "{name}: {lines}");
    }
    Ok(())
}

/// If nobody reads QEMU's output, the firmware notices, and the run ends.
#[test]
fn a_closed_output_ends_the_run() -> Result<()> {
    let mut command = qemu::command(&firmware::style("bare")?, None, "")?;
    let (reader, writer) = std::io::pipe()?;
    drop(reader);
    let mut child = command.stdin(Stdio::null()).stdout(writer).spawn()?;
    let begun = Instant::now();
    let status = loop {
        match child.try_wait()? {
            Some(status) => break Some(status),
            None if begun.elapsed() > HANG_TIMEOUT => break None,
            None => thread::sleep(Duration::from_millis(20)),
        }
    };
    if status.is_none() {
        child.kill()?;
        child.wait()?;
    }
    ensure!(status.is_some_and(|status| status.code() == Some(1)), "{status:?}");
    Ok(())
}
