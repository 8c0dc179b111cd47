//! Options that name a file, a folder or a board: what is missing, malformed or of another kind is refused with the
//! remedy, before any work.

use std::fs;
#[cfg(unix)]
use std::os::unix::fs::PermissionsExt as _;

use actq_bench::command::{actq, all, failed, run, succeeded};
use anyhow::{Result, ensure};

use super::bundle::{Robot, YAML, recording};
use super::fixture::text;

/// Imports the robot's bundle to the folder `out`, and makes the image `head.actq` of it.
fn with_image() -> Result<Robot> {
    let robot = Robot::new(YAML)?;
    succeeded(&run(robot.import("out", &["--accept-profile"]), b"")?)?;
    let (policy, image) = (text(&robot.path("out")), text(&robot.path("head.actq")));
    succeeded(&run(actq(&["quantize", &policy, "--method", "rtn", "--out", &image]), b"")?)?;
    Ok(robot)
}

#[test]
fn bad_files_are_named_with_the_remedy() -> Result<()> {
    let robot = with_image()?;
    let names = ["bundle", "new", "head.actq", "made.h", "none", "text", "raw.npz", "out/deploy.toml"];
    let [bundle, new, image, header, none, malformed, raw, description] = names.map(|name| text(&robot.path(name)));
    fs::write(robot.path("text"), "= 1")?;
    let key = text(&robot.path("key.pem"));
    let sign = ["sign", &image, "--version", "1", "--out", &new, "--key"];
    let import = ["import", &bundle, "--out", &new, "--accept-profile"];
    let constants = ["constants", &image, "--out", &header, "--gains"];
    let push = ["link", "push", "tcp:localhost:1", &image, "--signature"];
    let answers = [&import[..], &["--answers"]].concat();
    let form = "pass a TOML file of lines KEY = VALUE to --answers";
    let lines: [(&[&str], &str, &[&str]); 10] = [
        (&answers, &none, &["none: cannot read the answers", form]),
        (&answers, &bundle, &["bundle: cannot read the answers", form]),
        (&answers, &malformed, &["text: is not TOML", form]),
        (&constants, &none, &["none: cannot read the gains; pass the deploy.toml of the policy to --gains"]),
        (&constants, &malformed, &["text: is not a description; pass the deploy.toml"]),
        (&push, &none, &["none: cannot read the signature; pass a file that `actq sign` wrote to --signature"]),
        (&push, &description, &["deploy.toml: is not a signature; pass a file that `actq sign` wrote"]),
        (&sign, &malformed, &["text: is not an Ed25519 private key in PKCS #8 as PEM; make one with `actq keygen`"]),
        (&["import", "--accept-profile", "--out", &new], &none, &["none: cannot read the bundle"]),
        (
            &[&import[..], &["--calib"]].concat(),
            &recording(&robot)?,
            &["recording.npz: there is no raw array \"joint_pos\""],
        ),
    ];
    all(lines.map(|(line, file, messages)| {
        let words = [line, &[file]].concat();
        (words.join(" "), run(actq(&words), b"").and_then(|output| failed(&output, 1, messages)))
    }))?;
    ensure!(!robot.path("new").exists() && !robot.path("made.h").exists(), "something was written");
    // A key is no signature of the image either.
    succeeded(&run(actq(&["keygen", "--out", &key]), b"")?)?;
    failed(&run(actq(&[&push[..], &[&key]].concat()), b"")?, 1, &["key.pem: is not a signature"])?;
    failed(
        &run(actq(&["check", &image, "--reference", &format!("{raw}:{raw}")]), b"")?,
        1,
        &["it has none of the arrays"],
    )
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
case $* in *--list) echo 'stm32f405    thumbv7em-none-eabihf       a board' ;; esac
";

#[cfg(unix)]
#[test]
fn deploy_refuses_boards_and_recordings_before_the_import() -> Result<()> {
    let robot = Robot::new(YAML)?;
    fs::create_dir_all(robot.path("tools/xtask"))?;
    fs::write(robot.path("tools/xtask/Cargo.toml"), "")?;
    fs::create_dir(robot.path("bin"))?;
    fs::write(robot.path("bin/cargo"), CARGO)?;
    fs::set_permissions(robot.path("bin/cargo"), fs::Permissions::from_mode(0o755))?;
    let path = format!("{}:{}", robot.path("bin").display(), std::env::var("PATH").unwrap_or_default());
    let [bundle, out, none] = ["bundle", "deployed", "none.npz"].map(|name| text(&robot.path(name)));
    let deploy = |recording: &str, board: &str| {
        let mut command = actq(&["deploy", &bundle, "--out", &out, "--accept-profile", "--steps", "5"]);
        command.args(["--recordings", recording, "--board", board]);
        command.current_dir(robot.path("tools")).env("PATH", &path);
        run(command, b"")
    };
    let recording = recording(&robot)?;
    let words = ["--board stm32f4: there is no such board; use one of stm32f405"];
    failed(&deploy(&recording, "stm32f4")?, 1, &words)?;
    failed(&deploy(&none, "stm32f405")?, 1, &["none.npz: cannot read the file"])?;
    ensure!(!robot.path("deployed").exists(), "something was written");
    succeeded(&deploy(&recording, "stm32f405")?)?;
    let log = fs::read_to_string(robot.path("bin/cargo.log"))?;
    ensure!(log.contains("xtask firmware --board stm32f405 --image"), "{log}");
    Ok(())
}
