//! The raw inputs and the targets of an image with operations around its network: names, lengths and ranges. The
//! section follows the self-test vector.

use super::text::is_text;
use super::view::Image;
use super::words::{TooLarge, halves};
use super::words::{high, low, record, section};

/// Words of a port's record.
const PORT_WORDS: usize = 5;

/// Kinds of ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PortKind {
    /// A raw input.
    Input = 0,
    /// Targets of joint positions, in rad or m.
    Position = 1,
    /// Targets of joint velocities, in rad/s or m/s.
    Velocity = 2,
    /// Targets of joint torques, in N m, or forces, in N.
    Torque = 3,
}

impl PortKind {
    /// All kinds, by number.
    pub const ALL: &[Self] = &[Self::Input, Self::Position, Self::Velocity, Self::Torque];
}

/// A raw input, or targets: values that follow each other in the observation, or in the action.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(not(feature = "writer"), non_exhaustive)]
pub struct Port<'a> {
    /// Input, or the quantity of a target.
    pub kind: PortKind,
    /// Its name.
    pub name: &'a str,
    /// Names of its values, one a line, as those of joints; empty if they have none.
    pub names: &'a str,
    /// Number of values.
    pub len: usize,
    /// Lowest and highest value that a step accepts; infinite for no limit.
    pub range: [f32; 2],
}

#[cfg(feature = "writer")]
impl Port<'_> {
    /// Words of a record.
    pub const WORDS: usize = PORT_WORDS;

    /// Returns the record's words, with the offsets of the name and of the list of its values' names.
    ///
    /// # Errors
    ///
    /// [`TooLarge`] if a length does not fit its field.
    pub fn emit(&self, name: u32, names: u32) -> Result<[u32; PORT_WORDS], TooLarge> {
        let bytes = u8::try_from(self.name.len()).map_err(|_| TooLarge(self.name.len()))?;
        let [low, high] = self.range.map(f32::to_bits);
        Ok([halves(self.len, self.kind as usize | usize::from(bytes) << 8)?, low, high, name, names])
    }
}

impl<'a> Image<'a> {
    /// Returns the raw inputs in the order of the observation, then the targets in the order of the action. None if the
    /// image has no operations around its network, or this build does not run them.
    pub fn ports(&self) -> impl Iterator<Item = Port<'a>> + use<'a> {
        let image = *self;
        let [inputs, outputs] = image.port_counts();
        (0..inputs + outputs).map_while(move |i| image.port(i))
    }

    /// Returns the numbers of raw inputs and of targets.
    pub(super) fn port_counts(&self) -> [usize; 2] {
        let counts = if self.has_ports() { self.word(self.ports_at()) } else { 0 };
        [low(counts), high(counts)]
    }

    /// Returns `true` if the image has this section.
    #[inline(always)]
    pub(super) fn has_ports(&self) -> bool {
        cfg!(feature = "around") && self.header.kind() >> 8 != 0
    }

    /// Returns the section's offset.
    pub(super) fn ports_at(&self) -> usize {
        let steps = self.self_test_steps().wrapping_mul(self.obs_len() + self.act_len());
        self.header.self_test().wrapping_add(steps)
    }

    /// Returns the offset and the length of a port's name, in words, and the offset of the list of its values' names.
    pub(super) fn port_texts(&self, i: usize) -> [usize; 3] {
        let [sizes, _, _, name, names] = self.port_record(i).unwrap_or_default();
        [name as usize, (high(sizes) >> 8).div_ceil(4), names as usize]
    }

    /// Returns the words of the section before the names.
    pub(super) fn port_words(&self) -> usize {
        1 + self.port_counts().iter().sum::<usize>() * PORT_WORDS
    }

    /// Returns the number of values and the range of each raw input, without reading names: every step does.
    pub(crate) fn input_ranges(&self) -> impl Iterator<Item = (usize, [f32; 2])> {
        let [inputs, _] = self.port_counts();
        (0..inputs).map_while(|i| {
            let [sizes, least, most, ..] = self.port_record(i)?;
            Some((low(sizes), [least, most].map(f32::from_bits)))
        })
    }

    fn port_record(&self, i: usize) -> Option<[u32; PORT_WORDS]> {
        let record = record(self.words, self.ports_at().wrapping_add(1 + i * PORT_WORDS)).ok()?;
        Some(record.map(u32::from_le))
    }

    /// Reads a port; `None` if it is impossible, which a checked image excludes.
    pub(super) fn port(&self, i: usize) -> Option<Port<'a>> {
        let port = self.port_without_names(i)?;
        let [.., names] = self.port_texts(i);
        let names = if names == 0 { "" } else { self.names(names, port.len)? };
        Some(Port { names, ..port })
    }

    /// Reads a port but for the names of its values.
    pub(super) fn port_without_names(&self, i: usize) -> Option<Port<'a>> {
        let [sizes, least, most, name, _] = self.port_record(i)?;
        let name = self.text(name as usize, high(sizes) >> 8).filter(|name| is_text(name.as_bytes()))?;
        let kind = *PortKind::ALL.get(high(sizes) & 0xff)?;
        Some(Port { kind, name, names: "", len: low(sizes), range: [least, most].map(f32::from_bits) })
    }

    /// Reads a list of `count` names: u32 bytes, then the names, one a line.
    pub(super) fn names(&self, at: usize, count: usize) -> Option<&'a str> {
        let names = self.text(at.wrapping_add(1), self.word(at) as usize)?;
        let mut lines = 0;
        for line in names.split('\n') {
            if line.is_empty() || !is_text(line.as_bytes()) {
                return None;
            }
            lines += 1;
        }
        (lines == count).then_some(names)
    }

    fn text(&self, at: usize, bytes: usize) -> Option<&'a str> {
        let words = section(self.words, at, bytes.div_ceil(4))?;
        core::str::from_utf8(bytemuck::must_cast_slice(words).get(..bytes)?).ok()
    }
}
