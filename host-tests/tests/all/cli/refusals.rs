//! Refusals that are no cases of `crates/actq-cli/tests`: damaged images, outputs that cannot be written; and a reader that
//! closes the output.

use std::fs;
use std::process::Stdio;

use actq_bench::command::{actq, all, failed, run, succeeded};
use actq_link::RESET;
use anyhow::{Context, Result, ensure};

use super::fixture::{Fixture, text};

/// There is no policy either; a command that began its work would report that first.
#[test]
fn outputs_are_refused_before_any_work() -> Result<()> {
    let fixture = Fixture::new()?;
    let [policy, good, kept] = ["no-policy", "good", "kept"].map(|name| text(&fixture.out(name)));
    fs::write(fixture.out("file"), "")?;
    let before = fixture.snapshot()?;
    let mut bad =
        vec![text(&fixture.out("none/x")), text(&fixture.out("file/x")), text(&fixture.out(&"x".repeat(256)))];
    if cfg!(target_os = "linux") {
        // A folder in which no one can create a file, not even root.
        bad.push("/proc/x".to_owned());
    }
    let commands = |bad: &str| {
        [
            ["quantize", &policy, "--out", bad].map(str::to_owned).to_vec(),
            ["quantize", &policy, "--out", &good, "--save-stats", bad].map(str::to_owned).to_vec(),
            ["tune", &policy, "--drive", "true", "--out", bad].map(str::to_owned).to_vec(),
            ["tune", &policy, "--drive", "true", "--out", &good, "--json", bad].map(str::to_owned).to_vec(),
            ["tune", &policy, "--drive", "true", "--out", bad, "--keep", &kept].map(str::to_owned).to_vec(),
            ["sweep", &policy, "--json", bad].map(str::to_owned).to_vec(),
        ]
    };
    all(bad.iter().flat_map(|bad| commands(bad).map(|command| (bad, command))).map(|(bad, command)| {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let refused = run(actq(&words), b"").and_then(|output| failed(&output, 1, &[bad, "cannot write the file"]));
        (command.join(" "), refused)
    }))?;
    // The folder that tune keeps has files of its own.
    for file in ["round-0.actq", "round-1"] {
        let out = text(&fixture.out("kept").join(file));
        let line = ["tune", &policy, "--drive", "true", "--out", &out, "--keep", &kept];
        failed(&run(actq(&line), b"")?, 1, &[&out, "choose another name"])?;
    }
    ensure!(fixture.snapshot()? == before, "files changed");
    Ok(())
}

#[test]
fn the_longest_file_name_works() -> Result<()> {
    let fixture = Fixture::new()?;
    let out = fixture.out(&"x".repeat(255));
    succeeded(&fixture.quantize(&out, "")?)?;
    ensure!(out.exists(), "no image");
    Ok(())
}

#[test]
fn lines_without_a_command_have_status_2() -> Result<()> {
    let lines: [&[&str]; 2] = [&[], &["tune", "policy", "--out", "x.actq", "--drive", " "]];
    all(lines.map(|line| (format!("{line:?}"), run(actq(line), b"").and_then(|output| failed(&output, 2, &[])))))
}

/// A name that is no text does not hide the wrong option.
#[cfg(unix)]
#[test]
fn names_outside_unicode_leave_suggestions() -> Result<()> {
    let mut command = actq(&["inspect"]);
    let name: &std::ffi::OsStr = std::os::unix::ffi::OsStrExt::from_bytes(b"x\xff");
    command.arg(name).arg("--jsno");
    failed(&run(command, b"")?, 2, &["'--json'"])
}

#[test]
fn a_text_file_is_not_an_image() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = fixture.out("notes.txt");
    let image = text(&path);
    for len in [5, 127, 128, 1001] {
        fs::write(&path, "x".repeat(len))?;
        for command in ["inspect", "serve"] {
            failed(&run(actq(&[command, &image]), b"")?, 1, &["notes.txt: not an actq image"])?;
        }
    }
    Ok(())
}

#[test]
fn damaged_images_are_refused_by_every_command() -> Result<()> {
    let fixture = Fixture::new()?;
    let good = fs::read(fixture.image("")?)?;
    let flipped = |at: usize| {
        let mut bytes = good.clone();
        bytes[at] ^= 1 << (at % 8);
        (format!("bit flipped in byte {at}"), bytes)
    };
    // Every word of the header, and samples of the rest.
    let flips = (0..good.len()).filter(|at| at % 4 == 1 && (*at < 128 || at % 509 == 0)).chain([good.len() - 1]);
    let shorter = [0, 1, 3, 100, 128, good.len() / 2, good.len() - 4, good.len() - 1];
    let longer = ("four bytes more".to_owned(), [&good[..], &[0; 4]].concat());
    let damaged = flips
        .map(flipped)
        .chain(shorter.map(|len| (format!("{len} bytes left"), good[..len].to_vec())))
        .chain([longer]);
    let path = fixture.out("damaged.actq");
    let (image, policy) = (text(&path), text(&fixture.policy()));
    let commands: [&[&str]; 4] = [
        &["inspect", &image],
        &["eval", &image, "--policy", &policy],
        &["eval", &image, "--policy", &policy, "--json"],
        &["serve", &image],
    ];
    let refused = |bytes: &[u8]| {
        fs::write(&path, bytes)?;
        commands.iter().try_for_each(|command| {
            let output = run(actq(command), &[RESET])?;
            ensure!(output.stdout.is_empty(), "{command:?} prints something");
            failed(&output, 1, &[&image]).with_context(|| format!("{command:?}"))
        })
    };
    all(damaged.map(|(what, bytes)| (what, refused(&bytes))))?;
    fs::remove_file(&path)?;
    all(commands.map(|command| {
        (
            format!("{command:?} without a file"),
            run(actq(command), b"").and_then(|output| failed(&output, 1, &[&image])),
        )
    }))
}

/// The disk is full. clap prints the first three by itself.
#[cfg(target_os = "linux")]
#[test]
fn unwritable_outputs_are_errors() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = text(&fixture.image("")?);
    let commands: [&[&str]; 5] =
        [&["--version"], &["--help"], &["help", "inspect"], &["inspect", &image], &["inspect", &image, "--json"]];
    all(commands.map(|command| {
        let run = || {
            let full = fs::OpenOptions::new().write(true).open("/dev/full")?;
            let output = actq(command).stdout(full).stderr(Stdio::piped()).spawn()?.wait_with_output()?;
            failed(&output, 1, &["actq: cannot write to standard output: "])
        };
        (command.join(" "), run())
    }))
}

/// Users type `actq inspect image | head -1`.
#[test]
fn a_closed_output_causes_no_panic() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = text(&fixture.image("")?);
    let (policy, out) = (text(&fixture.policy()), text(&fixture.out("other.actq")));
    let commands: [&[&str]; 4] = [
        &["inspect", &image],
        &["eval", &image, "--policy", &policy],
        &["quantize", &policy, "--out", &out],
        &["--help"],
    ];
    all(commands.map(|command| {
        let run = || {
            let (reader, writer) = std::io::pipe()?;
            drop(reader);
            let output = actq(command).stdout(writer).stderr(Stdio::piped()).spawn()?.wait_with_output()?;
            let message = String::from_utf8_lossy(&output.stderr);
            ensure!(!message.contains("panicked") && !message.contains("cannot write"), "{message}");
            Ok(())
        };
        (command[0].to_owned(), run())
    }))
}
