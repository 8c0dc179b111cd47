//! Sizes from an image's header, before the image itself is checked: at compile time, too.

use super::crc::checksum;
use super::header::{self as h, Words};
use crate::error::ImageError;
use crate::layout::LAYOUT_STAMP;

/// Sizes from an image's header, which firmware needs for its arrays at compile time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ImageInfo {
    /// Length of the image, in bytes.
    pub bytes: usize,
    /// Values of an observation.
    pub obs_len: usize,
    /// Values of an action.
    pub act_len: usize,
    /// Scratch memory of a head, in words.
    pub scratch_words: usize,
}

impl ImageInfo {
    /// Reads the header of `bytes`, an image at any alignment. It checks magic, format version, length, checksum and
    /// kernel layout; [`Image::new_checked`](super::Image::new_checked) also checks the content.
    ///
    /// # Errors
    ///
    /// The first of these checks that fails.
    pub const fn read(bytes: &[u8]) -> Result<Self, ImageError> {
        let Some(header) = header(bytes) else { return Err(ImageError::TooShort) };
        if !bytes.len().is_multiple_of(4) {
            return Err(ImageError::Length);
        }
        let header = Words(&header);
        if let Err(error) = check_whole(header, bytes) {
            return Err(error);
        }
        let (obs_len, act_len, scratch_words) = (header.obs_len(), header.act_len(), header.scratch());
        Ok(Self { bytes: bytes.len(), obs_len, act_len, scratch_words })
    }
}

/// Returns the header's words as in memory; `None` if `bytes` is shorter.
pub(super) const fn header(bytes: &[u8]) -> Option<[u32; h::WORDS]> {
    let mut header = [0; h::WORDS];
    let mut rest = bytes;
    let mut i = 0;
    while i < h::WORDS {
        let Some((word, after)) = rest.split_first_chunk() else { return None };
        header[i] = u32::from_ne_bytes(*word);
        rest = after;
        i += 1;
    }
    Some(header)
}

/// Checks the fields about the whole image `bytes` in its header.
#[inline(always)]
pub(super) const fn check_whole(header: Words<'_>, bytes: &[u8]) -> Result<(), ImageError> {
    if header.magic() != h::MAGIC as usize {
        return Err(ImageError::Magic);
    }
    if header.version() != h::VERSION as usize || header.header_words() != h::WORDS {
        return Err(ImageError::Version);
    }
    if header.bytes() != bytes.len() {
        return Err(ImageError::Length);
    }
    if header.crc() as u32 != checksum(bytes) {
        return Err(ImageError::Checksum);
    }
    if header.layout() != LAYOUT_STAMP as usize {
        return Err(ImageError::Layout);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::Image;

    const VALID: &[u8] = include_bytes!("../../tests/valid.actq");

    #[test]
    fn info_agrees_with_the_image() {
        let words: Vec<u32> = VALID.as_chunks().0.iter().map(|word| u32::from_ne_bytes(*word)).collect();
        let image = Image::whole(bytemuck::cast_slice(&words)).expect("the image is whole");
        let (obs_len, act_len, scratch_words) = (image.obs_len(), image.act_len(), image.scratch_words());
        let info = ImageInfo { bytes: image.bytes(), obs_len, act_len, scratch_words };
        assert_eq!(ImageInfo::read(VALID), Ok(info));
    }

    #[test]
    fn info_refuses_what_is_not_a_whole_image() {
        assert_eq!(ImageInfo::read(b""), Err(ImageError::TooShort));
        assert_eq!(ImageInfo::read(&VALID[..4 * h::WORDS - 1]), Err(ImageError::TooShort));
        assert_eq!(ImageInfo::read(&VALID[..VALID.len() - 4]), Err(ImageError::Length));
        assert_eq!(ImageInfo::read(&VALID[..VALID.len() - 1]), Err(ImageError::Length));
        let changed = |word: usize| {
            let mut bytes = VALID.to_vec();
            bytes[4 * word] ^= 1;
            ImageInfo::read(&bytes)
        };
        assert_eq!(changed(0), Err(ImageError::Magic));
        assert_eq!(changed(h::W_VERSION), Err(ImageError::Version));
        assert_eq!(changed(h::W_BYTES), Err(ImageError::Length));
        assert_eq!(changed(h::W_CRC), Err(ImageError::Checksum));
        assert_eq!(changed(h::W_LAYOUT), Err(ImageError::Checksum));
        assert_eq!(changed(h::WORDS), Err(ImageError::Checksum));
    }
}
