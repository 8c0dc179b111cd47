//! The firmware under QEMU.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use actq_host_tests::golden;
use actq_host_tests::qemu::{self, Target};
use anyhow::{Result, ensure};

/// An image of the UR3 policy to build into the firmware; made once.
fn ur3_image() -> &'static Path {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    IMAGE.get_or_init(|| PathBuf::from("/work/main/target/img/ur3.actq"))
}

#[test]
fn kernels_give_the_golden_sums_on_the_target() -> Result<()> {
    let cases = golden::cases(2);
    for target in [Target::Fpu, Target::NoFpu] {
        let elf = qemu::build("golden", target, ur3_image())?;
        let output = qemu::run(qemu::command(&elf, None, ""), &golden::stream(&cases))?;
        let text = String::from_utf8_lossy(&output.stdout);
        ensure!(output.status.success(), "{target:?}: {text}");
        assert_eq!(text.trim(), format!("Armv7em: {} cases", cases.len()));
    }
    Ok(())
}
