//! The head in one's own firmware, in each style of `firmware-styles`, under QEMU.

use actq::runtime::ImageBuffer;
use actq_bench::firmware::{self, STYLE_NAMES, built_in};
use actq_bench::qemu;
use anyhow::{Context, Result, ensure};

/// The first action that the motors get has the host's bits, and control ticks have come while the head ran: a step of
/// 377 thousand instructions, of which one takes QEMU 32 ns here, and a tick each millisecond.
#[test]
fn every_style_acts_with_the_bits_of_the_host_below_its_tick() -> Result<()> {
    let buffer = ImageBuffer::read(built_in()?)?;
    let (_, expected) = buffer.image(built_in()?)?.self_test(0).context("it has a self-test")?;
    let expected: Vec<String> = expected.iter().map(|word| format!("{:08x}", u32::from_le(*word))).collect();
    for name in STYLE_NAMES {
        let mut command = qemu::command(&firmware::style(name)?, None, "")?;
        command.args(["-icount", "shift=5"]);
        let output = qemu::run(command, &[])?;
        let text = String::from_utf8_lossy(&output.stdout);
        ensure!(output.status.success(), "{name}: {text} {}", String::from_utf8_lossy(&output.stderr));
        let (ticks, action) = text.split_once(' ').context("there is no action")?;
        assert_eq!(action, expected.join(" "), "{name}");
        assert!((10..20).contains(&ticks.parse::<u32>()?), "{name}: {ticks} ticks in a step");
    }
    Ok(())
}
