//! The choices of method actquant, by the command that has it.

use std::fs;

use actq_bench::command::{failed, research, run, succeeded};
use actq_bench::ur3;
use anyhow::{Result, ensure};
use tempfile::TempDir;

#[test]
fn choices_reach_the_image() -> Result<()> {
    let folder = TempDir::new()?;
    let out = folder.path().join("image.actq");
    let quantize = |options: &str| {
        let mut command = research(&["quantize"]);
        command.arg(ur3()).arg("--out").arg(&out).args(options.split_whitespace());
        run(command, b"")
    };
    let image = |choices: &str| -> Result<Vec<u8>> {
        succeeded(&quantize(&format!("--method actquant --bpw 2.5 {choices}"))?)?;
        Ok(fs::read(&out)?)
    };
    let plain = image("")?;
    let defaults =
        "bandwidth=median,frames=512,score=gain,noise=codes,widest=8,head=free,samples=4096,batch=1,signs=random";
    ensure!(image(&format!("--actquant {defaults},magnitude=no"))? == plain, "these are the defaults");
    for choices in ["magnitude=yes", "samples=100"] {
        ensure!(image(&format!("--actquant {choices}"))? != plain, "{choices} changes nothing");
    }

    fs::remove_file(&out)?;
    for (options, status, words) in [
        ("--method gptq --actquant authors", 1, "--actquant has no effect on gptq"),
        ("--actquant authors", 1, "no effect on distill"),
        ("--method actquant --actquant heads=8", 2, "heads is not a key; the keys are bandwidth, frames"),
        ("--method actquant --actquant head=5", 2, "head takes 2, 3, 4 or 8, or free"),
    ] {
        failed(&quantize(options)?, status, &[words])?;
    }
    ensure!(!out.exists(), "a file was written");
    let mut sweep = research(&["sweep"]);
    sweep.arg(ur3()).args(["--methods", "rtn", "--actquant", "head=4"]);
    failed(&run(sweep, b"")?, 1, &["no effect on rtn"])
}
