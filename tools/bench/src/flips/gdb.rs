//! A connection to QEMU's GDB stub: registers, memory, breakpoints and the monitor of a stopped board (GDB's manual,
//! appendix E, remote serial protocol).

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use anyhow::{Context as _, Result, bail, ensure};

/// Bytes of memory in a packet; QEMU takes 4096 characters.
const PIECE: usize = 1024;

/// Number of the core's registers: r0 to r15 and xPSR.
pub(super) const CORE: usize = 17;

/// A connection to a stopped board.
#[derive(Debug)]
pub(super) struct Gdb {
    stream: UnixStream,
    /// Received bytes that no answer has used yet.
    received: Vec<u8>,
    /// Commands sent whose acceptance was not read yet: a trip to QEMU takes longer than a command.
    owed: Vec<String>,
}

impl Gdb {
    /// Wraps a new connection. A board that runs for longer than `timeout` without a stop is an error.
    pub(super) fn new(stream: UnixStream, timeout: Duration) -> Result<Self> {
        stream.set_read_timeout(Some(timeout))?;
        let mut gdb = Self { stream, received: Vec::new(), owed: Vec::new() };
        // Without a request for the description, QEMU uses the registers of an old format.
        gdb.command("qXfer:features:read:target.xml:0,fff")?;
        Ok(gdb)
    }

    fn send(&mut self, command: &str) -> Result<()> {
        let sum = command.bytes().fold(0u8, u8::wrapping_add);
        self.stream.write_all(format!("+${command}#{sum:02x}").as_bytes()).context("QEMU has ended")
    }

    fn answer(&mut self) -> Result<String> {
        loop {
            let begin = self.received.iter().position(|byte| *byte == b'$');
            let end = self.received.iter().position(|byte| *byte == b'#');
            if let (Some(begin), Some(end)) = (begin, end)
                && end + 2 < self.received.len()
            {
                let text = String::from_utf8_lossy(&self.received[begin + 1..end]).into_owned();
                self.received.drain(..end + 3);
                return Ok(text);
            }
            let mut bytes = [0; 4096];
            let count = self.stream.read(&mut bytes).context("QEMU does not answer")?;
            ensure!(count > 0, "QEMU has ended");
            self.received.extend(&bytes[..count]);
        }
    }

    fn command(&mut self, command: &str) -> Result<String> {
        self.send(command)?;
        for owed in std::mem::take(&mut self.owed) {
            let answer = self.answer()?;
            ensure!(answer == "OK", "QEMU's GDB stub answers {answer:?} to {owed}");
        }
        self.answer()
    }

    /// Sends a command that QEMU must accept before the next one.
    fn order(&mut self, command: String) -> Result<()> {
        self.send(&command)?;
        self.owed.push(command);
        Ok(())
    }

    /// Stops the board before the instruction at an address, from now on.
    pub(super) fn set_breakpoint(&mut self, address: u32) -> Result<()> {
        self.order(format!("Z0,{address:x},2"))
    }

    /// Removes such a stop.
    pub(super) fn clear_breakpoint(&mut self, address: u32) -> Result<()> {
        self.order(format!("z0,{address:x},2"))
    }

    /// Runs one instruction. No interrupt and no timer's event comes in it.
    pub(super) fn step(&mut self) -> Result<()> {
        self.stopped("s")
    }

    /// Runs to the next breakpoint after this instruction. (A breakpoint at this instruction would stop the board again.)
    pub(super) fn resume(&mut self) -> Result<()> {
        self.step()?;
        self.stopped("c")
    }

    fn stopped(&mut self, command: &str) -> Result<()> {
        let answer = self.command(command)?;
        ensure!(answer.starts_with('T') || answer.starts_with('S'), "QEMU's GDB stub answers {answer:?} to {command}");
        Ok(())
    }

    /// Returns r0 to r15 and xPSR.
    pub(super) fn core(&mut self) -> Result<[u32; CORE]> {
        let read = bytes(&self.command("g")?)?;
        let words: Vec<u32> = read.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        words.try_into().ok().context("QEMU has other registers")
    }

    /// Sets r0 to r15 and xPSR.
    pub(super) fn set_core(&mut self, registers: &[u32; CORE]) -> Result<()> {
        let bytes: Vec<u8> = registers.iter().flat_map(|register| register.to_le_bytes()).collect();
        self.order(format!("G{}", hex(&bytes)))
    }

    /// Returns the bytes of a register.
    pub(super) fn register_bytes(&mut self, number: u32) -> Result<Vec<u8>> {
        let answer = self.command(&format!("p{number:x}"))?;
        bytes(&answer).with_context(|| format!("register {number}"))
    }

    /// Sets the bytes of a register.
    pub(super) fn set_register_bytes(&mut self, number: u32, bytes: &[u8]) -> Result<()> {
        self.order(format!("P{number:x}={}", hex(bytes)))
    }

    /// Reads memory.
    pub(super) fn read(&mut self, address: u32, len: usize) -> Result<Vec<u8>> {
        let answer = self.command(&format!("m{address:x},{len:x}"))?;
        let read = bytes(&answer).with_context(|| format!("memory at {address:#x}"))?;
        ensure!(read.len() == len, "QEMU read {} of {len} bytes at {address:#x}", read.len());
        Ok(read)
    }

    /// Reads a word of memory.
    pub(super) fn word(&mut self, address: u32) -> Result<u32> {
        Ok(u32::from_le_bytes(self.read(address, 4)?[..].try_into()?))
    }

    /// Writes memory, also flash; not to peripherals.
    pub(super) fn write(&mut self, address: u32, bytes: &[u8]) -> Result<()> {
        (address..)
            .step_by(PIECE)
            .zip(bytes.chunks(PIECE))
            .try_for_each(|(address, piece)| self.order(format!("M{address:x},{:x}:{}", piece.len(), hex(piece))))
    }

    /// Runs a command of QEMU's monitor, which must print nothing.
    pub(super) fn monitor(&mut self, command: &str) -> Result<()> {
        let mut answer = self.command(&format!("qRcmd,{}", hex(command.as_bytes())))?;
        let mut printed = Vec::new();
        while let Some(text) = answer.strip_prefix('O').filter(|text| *text != "K") {
            printed.extend(bytes(text)?);
            answer = self.answer()?;
        }
        if answer != "OK" || !printed.is_empty() {
            bail!("QEMU's monitor answers {:?} to {command}", String::from_utf8_lossy(&printed));
        }
        Ok(())
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes(hex: &str) -> Result<Vec<u8>> {
    let digits = hex.as_bytes().as_chunks::<2>().0;
    let byte = |pair: &[u8; 2]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    digits.iter().map(byte).collect::<Option<_>>().with_context(|| format!("QEMU's GDB stub answers {hex:?}"))
}
