//! The application under QEMU, and the link to it.

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use actq_boards::Target;
use actq_device::client::Client;
use actq_device::connection::Connection;
use actq_device::event::Event;
use actq_device::port::Address;
use actq_link::report::Status;
use anyhow::{Context as _, Result, bail};
use tempfile::TempDir;

use crate::qemu::{in_slot, spawn};

/// How long an answer, or what [`until`] waits for, may take: a busy machine runs QEMU slowly.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// log2 of the nanoseconds that an instruction takes: 32 ns.
const INSTRUCTION: u32 = 5;

/// Between two looks whether an observation was refused.
const LOOK: Duration = Duration::from_millis(500);

/// An application under QEMU, whose serial port is a socket. It is ended with the value.
#[derive(Debug)]
pub struct Controller {
    child: Child,
    /// Of the socket.
    folder: TempDir,
}

impl Controller {
    /// Starts an application, with an image in the slot if one is given.
    pub fn start(target: Target, elf: &Path, slot: Option<&Path>) -> Result<Self> {
        Self::start_at(target, elf, slot, INSTRUCTION)
    }

    /// As [`Self::start`], with 2^`instruction` ns for an instruction.
    pub fn start_at(target: Target, elf: &Path, slot: Option<&Path>, instruction: u32) -> Result<Self> {
        let folder = TempDir::new()?;
        let serial = format!("unix:{},server=on,wait=off", socket(&folder).display());
        let mut command = target.run_with_serial(elf, &serial, instruction);
        in_slot(&mut command, elf, slot)?;
        // With its time aligned to the host's, QEMU says on its output when it is late.
        let child = spawn(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::inherit()))?;
        let controller = Self { child, folder };
        let begun = Instant::now();
        while !socket(&controller.folder).exists() {
            if begun.elapsed() > PATIENCE {
                bail!("QEMU does not open its serial port");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(controller)
    }

    /// The serial port.
    pub fn address(&self) -> Address {
        Address::Unix(socket(&self.folder).display().to_string())
    }

    /// A host at the serial port.
    pub fn client(&self) -> Result<Client> {
        Ok(Client::new(Connection::open(self.address(), PATIENCE)?, PATIENCE))
    }
}

/// The action on an observation, and whether the outputs follow it. On a line without faults, but on a machine that may stop QEMU for so
/// long that the firmware refuses the observation as an old one: it is then sent again.
pub fn act(client: &mut Client, observation: &[f32]) -> Result<(bool, Vec<f32>)> {
    let (begun, mut refused) = (Instant::now(), client.status()?.refused);
    let mut number = client.observe(observation)?;
    while begun.elapsed() < PATIENCE {
        let looked = Instant::now();
        while looked.elapsed() < LOOK {
            for event in client.events()? {
                if let Event::Action { of, applied, values, .. } = event
                    && of == number
                {
                    return Ok((applied, values));
                }
            }
        }
        let status = client.status()?;
        if status.refused != refused {
            refused = status.refused;
            number = client.observe(observation)?;
        }
    }
    bail!("no action: {:?}", client.status()?)
}

fn socket(folder: &TempDir) -> PathBuf {
    folder.path().join("serial")
}

/// Asks for the status until `wanted`.
pub fn until(client: &mut Client, what: &str, mut wanted: impl FnMut(&Status) -> bool) -> Result<Status> {
    let begun = Instant::now();
    loop {
        let status = client.status().with_context(|| format!("waiting until {what}"))?;
        if wanted(&status) {
            return Ok(status);
        }
        if begun.elapsed() > PATIENCE {
            bail!("not {what}: {status:?}");
        }
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        // Where it has ended already, there is nothing to end.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
