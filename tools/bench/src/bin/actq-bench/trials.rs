//! Parts that trials of policies in closed loop share: episodes, the firmware as the policy, and tables.

use std::path::{Path, PathBuf};

use actq::measure::size::bits_per_weight;
use actq::runtime::with_head;
use actq_bench::qemu::{self, Server};
use actq_bench::{bits, firmware, target_dir};
use actq_cli::report::table::table;
use actq_kernels::Image;
use anyhow::{Result, ensure};

/// First seed of the closed-loop episodes; the policy was trained and calibrated on others.
const FIRST_SEED: u64 = 1000;

/// Returns the folder of the demo's images.
pub(crate) fn folder() -> PathBuf {
    target_dir().join("demo")
}

/// First rows of every table.
const SIZES: [&str; 4] = ["bits per weight", "image bytes", "against f32", "scratch RAM bytes"];

/// A policy's column in a table.
pub(crate) struct Column {
    name: String,
    cells: Vec<String>,
}

impl Column {
    /// The column of a policy in f32: its size in bytes, then other cells.
    pub(crate) fn of_f32(bytes: usize, more: &[String]) -> Self {
        let sizes = ["32".to_owned(), bytes.to_string(), "1.0x".to_owned(), "-".to_owned()];
        Self { name: "f32".to_owned(), cells: [&sizes[..], more].concat() }
    }

    /// The column of an image: the sizes, then other cells.
    pub(crate) fn new(name: &str, image: &Image<'_>, f32_bytes: usize, more: &[String]) -> Self {
        let sizes = [
            format!("{:.2}", bits_per_weight(image)),
            image.bytes().to_string(),
            format!("{:.1}x", f32_bytes as f64 / image.bytes() as f64),
            (4 * image.scratch_words()).to_string(),
        ];
        Self { name: name.to_owned(), cells: [&sizes[..], more].concat() }
    }
}

/// Formats how many outcomes are a success.
pub(crate) fn share<T>(outcomes: &[T], is_success: impl Fn(&T) -> bool) -> String {
    format!("{} of {}", outcomes.iter().filter(|outcome| is_success(outcome)).count(), outcomes.len())
}

/// Returns the mean of a figure, in thousandths of its unit.
pub(crate) fn mean<T>(outcomes: &[T], of: impl Fn(&T) -> f64) -> f64 {
    1e3 * outcomes.iter().map(of).sum::<f64>() / outcomes.len().max(1) as f64
}

/// Formats columns, each with a cell for each row, or fewer, below those of the sizes.
pub(crate) fn summary(name: &str, more_rows: &[&str], columns: &[Column]) -> String {
    let names: Vec<&str> = std::iter::once(name).chain(columns.iter().map(|c| c.name.as_str())).collect();
    let mut summary = table(&names);
    for (i, row) in SIZES.iter().chain(more_rows).enumerate() {
        let cells = columns.iter().map(|c| c.cells.get(i).cloned().unwrap_or_else(|| "-".into()));
        summary.add_row(std::iter::once((*row).to_owned()).chain(cells));
    }
    summary.to_string()
}

/// Runs episodes from the first seed on.
pub(crate) fn closed_loop<T>(episodes: u64, mut episode: impl FnMut(u64) -> Result<T>) -> Result<Vec<T>> {
    (FIRST_SEED..FIRST_SEED + episodes).map(&mut episode).collect()
}

/// The result of a run with the firmware as the policy.
pub(crate) struct Firmware<T> {
    pub(crate) outcomes: Vec<T>,
    actions: usize,
    /// Actions with the same bits as the host executor's on the same observations.
    identical: usize,
}

impl<T> Firmware<T> {
    /// Runs episodes, each by its seed and by a step of the firmware.
    pub(crate) fn run(
        elf: &Path,
        image: Image<'_>,
        episodes: u64,
        mut episode: impl FnMut(u64, &mut dyn FnMut(&[f32]) -> Result<Vec<f32>>) -> Result<T>,
    ) -> Result<Self> {
        let mut server = Server::start(qemu::command(elf, None, "serve")?, image.act_len())?;
        let (mut actions, mut identical) = (0, 0);
        let outcomes = with_head(image, |head| {
            closed_loop(episodes, |seed| {
                head.reset();
                server.reset()?;
                episode(seed, &mut |obs| {
                    let action = server.step(obs)?;
                    let same = bits(&action) == bits(head.step(obs)?);
                    actions += 1;
                    identical += usize::from(same);
                    Ok(action)
                })
            })
        })?;
        server.finish()?;
        Ok(Self { outcomes, actions, identical })
    }

    /// Formats the result.
    ///
    /// # Errors
    ///
    /// If an action has other bits than the host's.
    pub(crate) fn report(&self, name: &str, success: &str, elf: &Path, image: Image<'_>) -> Result<String> {
        ensure!(self.identical == self.actions, "the firmware's actions differ from the host's");
        Ok(format!(
            "{name}, firmware in QEMU: success {success}, identical bits: {} of {} actions, {} bytes of code beside the image",
            self.identical,
            self.actions,
            firmware::flash_bytes(elf)? - image.bytes() as u64,
        ))
    }
}
