//! The host of QEMU or of a debugger, through semihosting: command line, standard input and output, exit status.

use core::fmt;

use heapless::String;

use crate::machine::asm;
use crate::machine::semihosting::{debug, syscall};

/// Ends the run.
pub fn exit(success: bool) -> ! {
    debug::exit(if success { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        asm::wfi();
    }
}

/// Returns the text after the program's name on the command line (QEMU: `-append`); empty if the host provides none.
pub fn arguments() -> String<64> {
    let mut buffer = [0u8; 128];
    let block = [buffer.as_mut_ptr() as usize, buffer.len() - 1];
    // SAFETY: SYS_GET_CMDLINE writes at most the length in the block to the buffer, which outlives the call.
    let failed = unsafe { syscall!(GET_CMDLINE, block[0], block[1]) } != 0;
    let text = core::ffi::CStr::from_bytes_until_nul(&buffer).ok().and_then(|t| t.to_str().ok());
    let mut arguments = String::new();
    if let (false, Some((_, rest))) = (failed, text.and_then(|t| t.trim().split_once(' '))) {
        let _ = arguments.push_str(rest.trim());
    }
    arguments
}

/// Opens standard output as text. Unlike the semihosting crates' stream it does not retry forever if the host's end is
/// closed.
pub fn stdout() -> Option<File> {
    File::open(c":tt", true)
}

/// Opens standard error, as [`stdout`] does.
pub fn stderr() -> Option<File> {
    File::open_as(c":tt", APPEND)
}

/// Modes of SYS_OPEN: fopen's "rb", "wb" and "a". In these modes the host's terminal ":tt" is standard input, output
/// and error.
const READ: usize = 1;
const WRITE: usize = 5;
const APPEND: usize = 8;

/// An open file of the host.
#[derive(Debug)]
pub struct File(usize);

impl File {
    /// Opens the host's file at `path`, which ends with a zero byte; `write` truncates it.
    pub fn open(path: &core::ffi::CStr, write: bool) -> Option<Self> {
        Self::open_as(path, if write { WRITE } else { READ })
    }

    fn open_as(path: &core::ffi::CStr, mode: usize) -> Option<Self> {
        // SAFETY: SYS_OPEN reads the path, whose length is given without its zero.
        let handle = unsafe { syscall!(OPEN, path.as_ptr() as usize, mode, path.count_bytes()) };
        (handle != usize::MAX).then_some(Self(handle))
    }

    /// Fills `buffer`; returns `false` if the file ended before.
    pub fn read_exact(&self, mut buffer: &mut [u8]) -> bool {
        while !buffer.is_empty() {
            // SAFETY: SYS_READ writes at most `len` bytes to the buffer.
            let left = unsafe { syscall!(READ, self.0, buffer.as_mut_ptr() as usize, buffer.len()) };
            // SYS_READ returns the number of bytes that it did not read.
            if left >= buffer.len() {
                return false;
            }
            let read = buffer.len() - left;
            buffer = &mut buffer[read..];
        }
        true
    }

    /// Writes all of `bytes`; returns `false` if the host refused.
    pub fn write_all(&self, bytes: &[u8]) -> bool {
        // SAFETY: SYS_WRITE reads `len` bytes from the buffer; it returns the number of bytes that it did not write.
        unsafe { syscall!(WRITE, self.0, bytes.as_ptr() as usize, bytes.len()) == 0 }
    }
}

impl fmt::Write for File {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if self.write_all(text.as_bytes()) { Ok(()) } else { Err(fmt::Error) }
    }
}
