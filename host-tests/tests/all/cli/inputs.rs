//! Options that name a file, a folder or a board: what is missing, malformed or of another kind is refused with the
//! remedy, before any work.

use std::fs;
#[cfg(unix)]
use std::os::unix::fs::PermissionsExt as _;

use actq_bench::command::{actq, failed, run, succeeded};
use actq_testkit::TWO_JOINTS;
use anyhow::{Result, ensure};

use super::bundle::{Robot, recording};
use super::fixture::text;

/// Imports the robot's bundle to the folder `out`, and makes the image `head.actq` of it.
fn with_image() -> Result<Robot> {
    let robot = Robot::new(TWO_JOINTS)?;
    succeeded(&run(robot.import("out", &["--accept-profile"]), b"")?)?;
    let (policy, image) = (text(&robot.path("out")), text(&robot.path("head.actq")));
    succeeded(&run(actq(&["quantize", &policy, "--method", "rtn", "--out", &image]), b"")?)?;
    Ok(robot)
}

#[test]
fn a_recording_of_raw_inputs_takes_no_policy() -> Result<()> {
    let robot = with_image()?;
    let [policy, image, drive] = ["out", "head.actq", "drive.npz"].map(|name| text(&robot.path(name)));
    let serve = ["serve", &image, "--record", &drive, "--policy", &policy];
    failed(
        &run(actq(&serve), b"")?,
        1,
        &["head.actq takes raw inputs, whose recordings have no labels; remove --policy"],
    )?;
    // Every command of a rollout has it in its environment.
    let mut command = actq(&serve[..4]);
    command.env("ACTQ_POLICY", &policy);
    succeeded(&run(command, b"")?).map(drop)
}

/// A `cargo` of a checkout with one board; it keeps the arguments that it is run with.
#[cfg(unix)]
const CARGO: &str = "#!/bin/sh
echo \"$*\" >> \"$0.log\"
case $* in *'--board stm32f4 --list') exit 1 ;; esac
";

#[cfg(unix)]
#[test]
fn deploy_refuses_boards_and_recordings_before_the_import() -> Result<()> {
    let robot = Robot::new(TWO_JOINTS)?;
    fs::create_dir(robot.path("bin"))?;
    fs::write(robot.path("bin/cargo"), CARGO)?;
    fs::set_permissions(robot.path("bin/cargo"), fs::Permissions::from_mode(0o755))?;
    let path = format!("{}:{}", robot.path("bin").display(), std::env::var("PATH").unwrap_or_default());
    let [bundle, out, none] = ["bundle", "deployed", "none.npz"].map(|name| text(&robot.path(name)));
    let deploy = |recording: &str, board: &str| {
        let mut command = actq(&["deploy", &bundle, "--out", &out, "--accept-profile", "--steps", "5"]);
        command.args(["--recordings", recording, "--board", board, "--sources"]).arg(robot.path("."));
        command.env("PATH", &path);
        run(command, b"")
    };
    let recording = recording(&robot)?;
    failed(&deploy(&recording, "stm32f4")?, 1, &["--board stm32f4: the sources in", "use another board"])?;
    failed(&deploy(&none, "stm32f405")?, 1, &["none.npz: cannot read the file"])?;
    ensure!(!robot.path("deployed").exists(), "something was written");
    succeeded(&deploy(&recording, "stm32f405")?)?;
    let log = fs::read_to_string(robot.path("bin/cargo.log"))?;
    ensure!(log.contains("xtask firmware --board stm32f405 --image"), "{log}");
    Ok(())
}
