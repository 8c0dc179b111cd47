//! What trials of policies in closed loop share: episodes, the firmware as the policy, and tables.

use std::path::{Path, PathBuf};

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

/// A policy's column in a table.
pub(crate) struct Column {
    pub(crate) name: String,
    pub(crate) cells: Vec<String>,
}

/// Formats columns, each with a cell for each row, or fewer.
pub(crate) fn summary(name: &str, rows: &[&str], columns: &[Column]) -> String {
    let names: Vec<&str> = std::iter::once(name).chain(columns.iter().map(|c| c.name.as_str())).collect();
    let mut summary = table(&names);
    for (i, row) in rows.iter().enumerate() {
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
