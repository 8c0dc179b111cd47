//! The application under QEMU, and the link to it.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use actq_boards::{Clock, Target};
use actq_client::client::Client;
use actq_client::connection::Connection;
use actq_client::event::Event;
use actq_client::port::{Address, Port};
use actq_link::report::Status;
use anyhow::{Context as _, Result, bail, ensure};
use tempfile::TempDir;

use crate::qemu::{in_slot, spawn};

/// Time without the awaited event after which QEMU counts as hung. No result depends on it: a busy machine, which runs
/// QEMU slowly, stays far below it, and a test waits for it only on a failure.
pub const HANG_TIMEOUT: Duration = Duration::from_secs(600);

/// log2 of the nanoseconds per instruction: 32 ns.
pub const INSTRUCTION: u32 = 5;

/// Period of the checks for a refused observation.
const REFUSAL_CHECK_PERIOD: Duration = Duration::from_millis(500);

/// An application under QEMU with a socket as its serial port. Dropping the value ends it.
#[derive(Debug)]
pub struct Controller {
    child: Child,
    /// Folder of the socket.
    folder: TempDir,
}

impl Controller {
    /// Starts an application, with an image in the slot if one is given. Its time counts instructions.
    pub fn start(target: Target, elf: &Path, slot: Option<&Path>) -> Result<Self> {
        Self::start_by(target, elf, slot, Clock::Counted(INSTRUCTION))
    }

    /// Does the same as [`Self::start`] with another clock.
    pub fn start_by(target: Target, elf: &Path, slot: Option<&Path>, clock: Clock) -> Result<Self> {
        let folder = TempDir::new()?;
        let serial = format!("unix:{},server=on,wait=off", socket(&folder).display());
        let mut command = target.run_with_serial(elf, &serial, clock);
        command.arg("-qmp").arg(format!("unix:{},server=on,wait=off", monitor(&folder).display()));
        in_slot(&mut command, elf, slot)?;
        // With its time aligned to the host's, QEMU prints a message when it is late.
        let child = spawn(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::inherit()))?;
        let controller = Self { child, folder };
        let begun = Instant::now();
        // The socket appears in its folder a moment before QEMU listens. A connection opened then is closed at once.
        while !(controller.address().open().is_ok() && controller.monitor().open().is_ok()) {
            if begun.elapsed() > HANG_TIMEOUT {
                bail!("QEMU did not open its serial port in {HANG_TIMEOUT:?}");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(controller)
    }

    /// Returns the serial port.
    pub fn address(&self) -> Address {
        Address::Unix(socket(&self.folder).display().to_string())
    }

    /// Resets the board, as its reset pin does (QEMU's `system_reset`). Memory keeps its content.
    pub fn reset(&self) -> Result<()> {
        let mut monitor = self.monitor().open().context("QEMU's monitor")?;
        for command in ["qmp_capabilities", "system_reset"] {
            writeln!(monitor, "{{\"execute\": \"{command}\"}}")?;
            answered(&mut *monitor).with_context(|| format!("QEMU's {command}"))?;
        }
        Ok(())
    }

    /// Connects a host to the serial port.
    pub fn client(&self) -> Result<Client> {
        Ok(Client::new(Connection::open(self.address(), HANG_TIMEOUT)?, HANG_TIMEOUT))
    }

    fn monitor(&self) -> Address {
        Address::Unix(monitor(&self.folder).display().to_string())
    }
}

fn socket(folder: &TempDir) -> PathBuf {
    folder.path().join("serial")
}

fn monitor(folder: &TempDir) -> PathBuf {
    folder.path().join("monitor")
}

/// Waits for the answer to a command of QEMU's monitor. Greeting and events may come before it.
fn answered(monitor: &mut dyn Port) -> Result<()> {
    let (begun, mut reply) = (Instant::now(), String::new());
    while !reply.contains("\"return\"") {
        ensure!(
            !reply.contains("\"error\"") && begun.elapsed() < HANG_TIMEOUT,
            "QEMU's monitor command failed: {reply:?}"
        );
        let mut bytes = [0; 512];
        match monitor.read(&mut bytes) {
            Ok(count) => reply += &String::from_utf8_lossy(bytes.get(..count).unwrap_or_default()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// Returns the action on an observation, and `true` if the outputs follow it. The line has no faults, but the machine
/// may stop QEMU for so long that the firmware refuses the observation as too old, or latches before its action: then
/// the observation is sent again.
pub fn act(client: &mut Client, observation: &[f32]) -> Result<(bool, Vec<f32>)> {
    let known = |status: &Status| (status.refused, status.token);
    let (begun, mut before) = (Instant::now(), known(&client.status()?));
    let mut number = client.observe(observation)?;
    while begun.elapsed() < HANG_TIMEOUT {
        let looked = Instant::now();
        while looked.elapsed() < REFUSAL_CHECK_PERIOD {
            for event in client.events()? {
                if let Event::Action { of, applied, values, .. } = event
                    && of == number
                {
                    return Ok((applied, values));
                }
            }
        }
        let now = known(&client.status()?);
        if now != before {
            before = now;
            number = client.observe(observation)?;
        }
    }
    bail!("no action came: {:?}", client.status()?)
}

/// Returns the actions on observations in order, from a new state of the head. If the machine delays the host for so
/// long that the line counts as silent, the controller takes a new token and the head restarts: then all are requested
/// again.
pub fn act_in_order(client: &mut Client, observations: &[Vec<f32>]) -> Result<Vec<(bool, Vec<f32>)>> {
    let begun = Instant::now();
    while begun.elapsed() < HANG_TIMEOUT {
        client.disarm()?;
        let token = client.status()?.token;
        let actions = observations.iter().map(|observation| act(client, observation)).collect::<Result<_>>()?;
        if client.status()?.token == token {
            return Ok(actions);
        }
    }
    bail!("could not get {} actions under one token: {:?}", observations.len(), client.status()?)
}

/// Polls the status until `wanted` accepts it.
pub fn wait_until(client: &mut Client, what: &str, mut wanted: impl FnMut(&Status) -> bool) -> Result<Status> {
    let begun = Instant::now();
    loop {
        let status = client.status().with_context(|| format!("cannot wait until {what}"))?;
        if wanted(&status) {
            return Ok(status);
        }
        if begun.elapsed() > HANG_TIMEOUT {
            bail!("timeout waiting until {what}: {status:?}");
        }
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        // Nothing to do if it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
