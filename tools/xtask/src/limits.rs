//! `--limits` of `cargo xtask firmware`.

use std::fs;
use std::path::Path;

use actq_controller::Limits;
use actq_firmware_demo::image::axis;
use actq_kernels::Image;
use anyhow::{Context as _, Result, bail, ensure};

/// Reads the value of `--limits`: one for all axes, or a file with a line for each.
pub(crate) fn read(value: &str) -> Result<Vec<Limits>> {
    let error = match value.parse() {
        Ok(limits) => return Ok(vec![limits]),
        Err(error) => error,
    };
    let path = Path::new(value);
    ensure!(path.is_file(), "--limits {value:?}: no file has this name, and {error}");
    let text = fs::read_to_string(path).with_context(|| format!("cannot read the file of --limits {value}"))?;
    ensure!(!text.trim().is_empty(), "--limits {value}: the file is empty; it takes a line LOW:HIGH for each axis");
    let line = |(i, line): (usize, &str)| line.parse().with_context(|| format!("{value}, line {}: {line:?}", i + 1));
    text.trim_end().lines().enumerate().map(line).collect()
}

/// Lists the actions of an image without finite limits, of their own or of the build, as "action 0". Fails if an action
/// has limits with which the application, at `hz` ticks per second, does not move its axis.
pub(crate) fn without_limits(limits: &[Limits], image: &Image<'_>, hz: u32) -> Result<Vec<String>> {
    still(limits, image.act_len(), |i| image.limits(i), hz)
}

fn still(
    limits: &[Limits],
    actions: usize,
    contract: impl Fn(usize) -> Option<[f32; 2]>,
    hz: u32,
) -> Result<Vec<String>> {
    let given = limits.len();
    ensure!(
        given < 2 || given == actions,
        "--limits has {given} lines, the image has {actions} actions; give one line for each"
    );
    let mut still = Vec::new();
    for i in 0..actions {
        match (Limits::of_axis(i, contract(i), limits), contract(i)) {
            (Some(limits), _) => {
                axis(limits, hz as f32).with_context(|| {
                    format!(
                        "action {i} with limits {limits} at {hz} ticks per second; give a larger RATE, the change in a \
                         second, by --limits LOW:HIGH:RATE"
                    )
                })?;
            }
            (None, Some([low, high])) if !limits.is_empty() => {
                bail!("--limits leaves no value for action {i}, which the image limits to {low}:{high}")
            }
            // It has at most one limit.
            (None, _) => still.push(format!("action {i}")),
        }
    }
    Ok(still)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_that_move_nothing_are_refused() {
        let still = |text: &str, hz| still(&[text.parse().expect("limits")], 2, |_| None, hz);
        for (text, hz) in [("-1:1:0.0001", 1000), ("-1:1:0.0009", 8000), ("1000:1000.01", 1000)] {
            let error = format!("{:#}", still(text, hz).expect_err("refused"));
            let [begins, ends] =
                [format!("action 0 with limits {text} at {hz} ticks"), "too small beside its limits".into()];
            assert!(error.starts_with(&begins) && error.ends_with(&ends), "{error}");
        }
        for (text, hz) in [("-1:1:0.0002", 1000), ("-1:1:0.001", 8000), ("-2e38:2e38", 1000), ("3:3", 1000)] {
            assert_eq!(still(text, hz).expect("a rate"), [""; 0], "{text}");
        }
    }

    #[test]
    fn limits_are_read_or_refused() {
        let limits = |low, high, rate| Limits { low, high, rate };
        assert_eq!(read("-1:2").expect("limits"), [limits(-1.0, 2.0, None)]);
        let file = std::env::temp_dir().join(format!("actq-limits-{}", std::process::id()));
        let name = file.display().to_string();
        fs::write(&file, "-1:1\n0:2.5:10\n").expect("written");
        assert_eq!(read(&name).expect("limits"), [limits(-1.0, 1.0, None), limits(0.0, 2.5, Some(10.0))]);
        for (text, why) in [
            ("-1:1\n\n-1:1", "line 2: \"\": limits have the form LOW:HIGH or LOW:HIGH:RATE"),
            ("-1:1\n2:1\n", "line 2: \"2:1\": the lower limit exceeds the upper one; the form is LOW:HIGH"),
            ("\n", "the file is empty; it takes a line LOW:HIGH for each axis"),
        ] {
            fs::write(&file, text).expect("written");
            let error = format!("{:#}", read(&name).expect_err("refused"));
            assert!(error.contains(&name) && error.ends_with(why), "{error}");
        }
        fs::remove_file(&file).expect("removed");
        let error = format!("{:#}", read("-1:one").expect_err("refused"));
        assert_eq!(
            error,
            "--limits \"-1:one\": no file has this name, and limits are finite numbers: LOW:HIGH or LOW:HIGH:RATE"
        );
    }
}
