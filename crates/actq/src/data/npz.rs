//! Archives of arrays in numpy's format .npz: a ZIP file (APPNOTE.TXT 6.3) of .npy members, stored or deflated.
//!
//! It is a reader of its own because an archive can declare any size. A member's declared size is compared with the
//! file before anything is inflated, and no more is inflated than declared.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use flate2::CrcReader;
use flate2::read::DeflateDecoder;

use super::npy;
use crate::error::{Context, Result, bail, ensure};
use crate::import::values::Tensor;

/// Inflated bytes that the members of any archive may have.
const MIN_INFLATED_LIMIT: u64 = 64 << 20;
/// Inflated bytes that a larger archive may have, per byte of its own. Recorded motions keep most of their size when
/// deflated; data that keeps less than a sixty-fourth hardly changes.
const INFLATED_PER_BYTE: u64 = 64;

/// End record of the format: signature, and length without the variable part.
const END_RECORD: ([u8; 4], usize) = (*b"PK\x05\x06", 22);
const DIRECTORY_ENTRY: ([u8; 4], usize) = (*b"PK\x01\x02", 46);
const LOCAL_HEADER: ([u8; 4], usize) = (*b"PK\x03\x04", 30);

/// An archive and its directory.
pub(super) struct Archive {
    file: File,
    bytes: u64,
    members: BTreeMap<String, Member>,
    /// Inflated bytes of the members read so far.
    inflated: u64,
}

/// A member as the directory describes it.
struct Member {
    encrypted: bool,
    method: usize,
    crc: u64,
    /// Bytes in the archive, and inflated.
    packed: u64,
    size: u64,
    /// Offset of its local header.
    at: u64,
}

impl Archive {
    /// Reads the directory. It refuses two members of one name.
    pub(super) fn open(mut file: File) -> Result<Self> {
        let (bytes, entries) = directory(&mut file).context("not an .npz archive, or a truncated one")?;
        let mut members = BTreeMap::new();
        for (name, member) in entries {
            let before = members.insert(name.clone(), member);
            ensure!(before.is_none(), "array {name:?} occurs twice");
        }
        Ok(Self { file, bytes, members, inflated: 0 })
    }

    /// Returns the names of all arrays.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.members.keys().map(String::as_str)
    }

    /// Reads an array; `None` if the archive has none of this name.
    pub(super) fn read(&mut self, name: &str) -> Result<Option<Tensor>> {
        let Some(&Member { encrypted, method, crc, packed, size, at }) = self.members.get(name) else {
            return Ok(None);
        };
        self.inflated += size;
        let limit = MIN_INFLATED_LIMIT.max(INFLATED_PER_BYTE.saturating_mul(self.bytes));
        ensure!(
            self.inflated <= limit,
            "it has {size} bytes, and all arrays up to it {}; an archive of {} bytes may hold {limit} ({INFLATED_PER_BYTE} times its size, \
             at least {} MiB); save it uncompressed, with numpy.savez",
            self.inflated,
            self.bytes,
            MIN_INFLATED_LIMIT >> 20
        );
        ensure!(!encrypted, "it is encrypted; save it without a password");
        let local = read_at(&mut self.file, at, LOCAL_HEADER.1 as u64).context("truncated")?;
        ensure!(local.starts_with(&LOCAL_HEADER.0), "the directory does not point to a local header");
        let data = at + (LOCAL_HEADER.1 + u16_at(&local, 26) + u16_at(&local, 28)) as u64;
        ensure!(data + packed <= self.bytes, "truncated: the array extends beyond the file");
        self.file.seek(SeekFrom::Start(data))?;
        let stream = BufReader::new((&self.file).take(packed));
        let inflated: Box<dyn Read> = match method {
            0 => Box::new(stream),
            8 => Box::new(DeflateDecoder::new(stream)),
            other => bail!("it is compressed by method {other}; save it with numpy.savez or numpy.savez_compressed"),
        };
        // One more byte detects a member that is longer than declared.
        let mut checked = CrcReader::new(inflated.take(size + 1));
        let array = npy::read(&mut checked, size)?;
        let over = checked.read(&mut [0])?;
        ensure!(over == 0, "it has more than the {size} bytes that the archive declares");
        ensure!(u64::from(checked.crc().sum()) == crc, "its checksum is wrong: the file is damaged");
        Ok(Some(array))
    }
}

/// Returns the archive's size and its members with their names, without the extension .npy.
fn directory(file: &mut File) -> Result<(u64, Vec<(String, Member)>)> {
    let bytes = file.seek(SeekFrom::End(0))?;
    // The end record is followed by a comment of at most 65535 bytes.
    let tail_at = bytes.saturating_sub((END_RECORD.1 + usize::from(u16::MAX)) as u64);
    let tail = read_at(file, tail_at, bytes - tail_at)?;
    let is_end =
        |at: &usize| tail[*at..].starts_with(&END_RECORD.0) && u16_at(&tail, at + 20) == tail.len() - at - END_RECORD.1;
    let end =
        (0..(tail.len() + 1).saturating_sub(END_RECORD.1)).rev().find(is_end).context("the directory is missing")?;
    let (count, len, at) = (u16_at(&tail, end + 10), u32_at(&tail, end + 12), u32_at(&tail, end + 16));
    // ZIP64 stores numbers elsewhere that do not fit.
    ensure!(count < 0xffff && at < 0xffff_ffff, "archives of 4 GiB or 65535 members are not supported");
    ensure!(at + len <= tail_at + end as u64, "the directory extends beyond the file");
    let directory = read_at(file, at, len)?;
    let mut rest = &directory[..];
    let mut members = Vec::new();
    for _ in 0..count {
        let (name, member, following) = Member::parse(rest).context("the directory is damaged")?;
        members.push((name, member));
        rest = following;
    }
    Ok((bytes, members))
}

impl Member {
    /// Parses the first entry of a directory; returns it with its name and the bytes that follow.
    fn parse(bytes: &[u8]) -> Option<(String, Self, &[u8])> {
        let entry = bytes.get(..DIRECTORY_ENTRY.1).filter(|entry| entry.starts_with(&DIRECTORY_ENTRY.0))?;
        let name_len = u16_at(entry, 28);
        let name = String::from_utf8_lossy(bytes.get(DIRECTORY_ENTRY.1..DIRECTORY_ENTRY.1 + name_len)?);
        let following = bytes.get(DIRECTORY_ENTRY.1 + name_len + u16_at(entry, 30) + u16_at(entry, 32)..)?;
        let member = Self {
            encrypted: u16_at(entry, 8) & 1 != 0,
            method: u16_at(entry, 10),
            crc: u32_at(entry, 16),
            packed: u32_at(entry, 20),
            size: u32_at(entry, 24),
            at: u32_at(entry, 42),
        };
        Some((name.strip_suffix(".npy").unwrap_or(&name).to_owned(), member, following))
    }
}

fn read_at(file: &mut File, at: u64, len: u64) -> Result<Vec<u8>> {
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    file.take(len).read_to_end(&mut bytes)?;
    ensure!(bytes.len() as u64 == len, "the file is truncated");
    Ok(bytes)
}

/// Returns the u16 at `at`, which is within `bytes`.
fn u16_at(bytes: &[u8], at: usize) -> usize {
    usize::from(bytes[at]) | usize::from(bytes[at + 1]) << 8
}

fn u32_at(bytes: &[u8], at: usize) -> u64 {
    (u16_at(bytes, at) | u16_at(bytes, at + 2) << 16) as u64
}
