//! `cargo xtask firmware` as typed: the application with an image, for a board, in a file.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use actq::methods::Activations;
use actq::runtime::ImageBuffer;
use actq_bench::command::{all, failed, run, succeeded};
use actq_bench::controller::{Controller, act};
use actq_bench::firmware::{built_in, controller};
use actq_bench::networks::Builder;
use actq_bench::{Target, bits, root};
use actq_kernels::Width;
use actq_link::code::{Parameter, Refusal};
use actq_link::report::BUILT_IN;
use anyhow::Result;
use tempfile::TempDir;

use super::application::{arm, self_test, small, small_with_limits};

/// Boards that other tools request by this command.
const BOARDS: [Target; 3] = [Target::Fpu, Target::F405, Target::M33];

fn firmware(words: &[&str]) -> Result<Output> {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root()).args(["xtask", "firmware"]).args(words);
    run(command, &[])
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// Without an image the file is the other tests' application; with one, it gives the image's bits. If the image has no
/// limits, its axes have those of the build; without any limits it cannot be armed.
#[test]
fn every_board_accepts_the_example_or_another_image() -> Result<()> {
    let folder = TempDir::new()?;
    let own = folder.path().join("own.actq");
    fs::write(&own, small()?)?;
    for target in BOARDS {
        let (name, elf) = (target.board().name, folder.path().join("firmware.elf"));
        let printed = succeeded(&firmware(&["--board", name, "--out", &text(&elf)])?)?;
        assert!(printed.contains(&format!("{}: {name} with {}", text(&elf), text(built_in()?))), "{printed}");
        assert!(
            fs::read(&elf)? == fs::read(controller(target, "")?)?,
            "{name}: differs from the application of the tests"
        );

        // An existing file is replaced.
        let is_limited = target != Target::M33;
        let limits = if is_limited { &["--limits", "-0.5:0.75:10"][..] } else { &[] };
        let output = firmware(&[&["--board", name, "--image", &text(&own), "--out", &text(&elf)], limits].concat())?;
        succeeded(&output)?;
        let warning = "warning: ".to_owned() + &text(&own) + ": no finite limits for action 0, action 1,";
        assert_eq!(String::from_utf8_lossy(&output.stderr).contains(&warning), !is_limited, "{name}");
        let buffer = ImageBuffer::read(&own)?;
        let image = buffer.image(&own)?;
        let controller = Controller::start(target, &elf, None)?;
        let mut client = controller.client()?;
        let status = client.status()?;
        assert_eq!((status.image, status.slot), (image.crc(), BUILT_IN), "{name}");
        let (observation, expected) = self_test(&image, 0)?;
        let (_, action) = act(&mut client, &observation)?;
        assert_eq!(bits(&action), expected, "{name}");
        let axis = [Parameter::Low, Parameter::High, Parameter::Rate].map(|parameter| client.get(parameter, 1));
        let expected = if is_limited { [-0.5, 0.75, 0.01] } else { [0.0; 3] };
        assert_eq!(axis.into_iter().collect::<Result<Vec<_>>>()?, expected, "{name}");
        // (QEMU has no clock for an STM32F405, which is a reason of its own.)
        match arm(&mut client, &observation) {
            Ok(()) => assert_eq!(target, Target::Fpu),
            Err(error) => {
                let refusal = if is_limited { Refusal::Clock } else { Refusal::Limits };
                assert!(format!("{error:#}").contains(&refusal.to_string()), "{name}: {error:#}");
            }
        }
    }
    Ok(())
}

/// An image of one product, too large for an STM32F405's program memory, or for its scratch memory.
fn large(rows: usize, cols: usize) -> Result<Vec<u8>> {
    let mut builder = Builder::new(cols);
    builder.linear((rows, cols), Activations::Int8, |_| Some(Width::W8), 0, false)?;
    builder.image("large")
}

#[test]
fn failed_builds_are_reported_and_leave_no_file() -> Result<()> {
    let folder = TempDir::new()?;
    let path = |name: &str| text(&folder.path().join(name));
    let good = small()?;
    let mut damaged = good.clone();
    damaged[good.len() / 2] ^= 1;
    for (name, bytes) in [
        ("good", &good),
        ("damaged", &damaged),
        ("bounded", &small_with_limits()?),
        ("limits", &b"-1:1\n-1:1\n".to_vec()),
        ("long", &large(800, 800)?),
        ("wide", &large(4, 16 << 10)?),
    ] {
        fs::write(path(name), bytes)?;
    }
    let there = || -> Result<Vec<_>> {
        let mut there = fs::read_dir(folder.path())?.map(|entry| Ok(entry?.file_name())).collect::<Result<Vec<_>>>()?;
        there.sort();
        Ok(there)
    };
    let (before, elf) = (there()?, path("firmware.elf"));
    let (nowhere, itself) = (path("none/firmware.elf"), path("good"));
    let refused = |words: &[&str], status, expected: &[&str]| {
        let outcome = firmware(words).and_then(|output| failed(&output, status, expected));
        (words.join(" "), outcome)
    };
    let image = |name: &str, out: &str, expected: &[&str]| {
        refused(&["--board", "stm32f405", "--image", &path(name), "--out", out], 1, expected)
    };
    let limited = |name: &str, limits: &str, expected: &[&str]| {
        let words = ["--board", "stm32f405", "--image", &path(name), "--limits", limits, "--out", &elf];
        refused(&words, 1, expected)
    };
    all([
        refused(&["--board", "nucleo", "--out", &elf], 2, &["'nucleo'", "unknown board", "stm32f405"]),
        refused(&["--board", "stm32f405"], 2, &["--out <FILE.elf>", "Usage: cargo xtask firmware"]),
        refused(&["--board", "stm32f405", "--img", "a", "--out", &elf], 2, &["unexpected argument '--img'", "Usage"]),
        image("none", &elf, &["cannot read the image", "none"]),
        image("damaged", &elf, &["damaged: not a valid image", "actq quantize"]),
        image("wide", &elf, &["wide: needs", "words of scratch memory", "stm32f405 has 12288"]),
        image("long", &elf, &["no room for", "long", "actq quantize --flash", "boards/src/stm32f405/memory.x"]),
        image("good", &nowhere, &["the folder", "does not exist"]),
        image("good", &text(folder.path()), &["is a folder"]),
        image("good", &itself, &["is the image itself"]),
        limited("good", "1:-1", &["--limits \"1:-1\"", "the lower limit exceeds the upper one"]),
        limited("good", &path("limits"), &["--limits has 2 lines, the image has 6 actions"]),
        limited("good", "-1:1:0.0001", &["good: action 0 with limits -1:1:0.0001 at 1000 ticks", "larger RATE"]),
        limited("bounded", "1001:1002", &["--limits leaves no value for action 0", "limits to -1000:1000"]),
    ])?;
    assert_eq!(there()?, before);
    assert!(fs::read(path("good"))? == good);
    Ok(())
}
