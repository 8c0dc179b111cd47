//! Images: open, check, query.

use core::ffi::c_char;
use core::ops::Range;

use actq_kernels::{Image, ImageError, Port};

use crate::memory::{Buffer, all_apart, apart, seal};
use crate::status::{ActqStatus, Code, Failure, status};

const MAGIC: u32 = u32::from_le_bytes(*b"ACTI");

/// An image. The caller provides its memory and does not look into it. It refers to the image's bytes, which must stay
/// as they are.
#[derive(Debug)]
#[repr(C)]
pub struct ActqImage {
    opaque: [usize; 6],
}

/// The content of an opened [`ActqImage`].
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct Opened {
    seal: usize,
    /// Address of the image's bytes.
    at: usize,
    pub(crate) image: Image<'static>,
}

impl Opened {
    /// Returns the addresses of the image's bytes.
    pub(crate) fn bytes(&self) -> Range<usize> {
        self.at..self.at + self.image.bytes()
    }
}

const _: () = assert!(size_of::<Opened>() <= size_of::<ActqImage>() && align_of::<Opened>() <= align_of::<ActqImage>());

/// Numbers of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Sizes {
    /// Bytes of the image.
    pub image_bytes: usize,
    /// Words of scratch memory that a head needs, each of 32 bits.
    pub scratch_words: usize,
    /// Values of an observation.
    pub observation_len: usize,
    /// Values of an action.
    pub action_len: usize,
    /// Actions that one evaluation of the network gives.
    pub chunk: usize,
    /// Actions of a chunk that play before the network runs again.
    pub execute: usize,
    /// Raw inputs and targets with names: the number of ports.
    pub ports: usize,
    /// Control steps a second that the policy was trained for.
    pub rate_hz: f32,
    /// Checksum in the image's header (CRC-32).
    pub crc: u32,
}

/// Text in an image. No zero ends it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Text {
    /// UTF-8.
    pub data: *const c_char,
    /// Bytes.
    pub len: usize,
}

/// A raw input or targets: values that follow each other in the observation, or in the action.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct CPort {
    /// 0: raw input; targets of 1: positions (rad or m), 2: velocities (rad/s or m/s), 3: torques or forces (N m or N).
    pub kind: u32,
    /// Index of its first value in the observation, or in the action.
    pub offset: usize,
    /// Number of values.
    pub len: usize,
    /// Lowest value that a step accepts; infinite for no limit.
    pub low: f32,
    /// Highest value that a step accepts; infinite for no limit.
    pub high: f32,
    /// Its name.
    pub name: Text,
    /// Names of its values, one a line, as those of joints; empty if they have none.
    pub names: Text,
}

/// The cost of a step that runs the network on a Cortex-M4F, by the cost model (docs/KERNELS.md).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct CCost {
    /// Instructions.
    pub instructions: u64,
    /// Cycles, if memory never waits.
    pub cycles: u64,
    /// The smallest budget of a poll, instructions.
    pub least_budget: u32,
}

/// Borrows an opened image.
///
/// # Safety
///
/// `image` is null, misaligned, or valid for reads; if it was opened, the image's bytes are as they were.
pub(crate) unsafe fn opened(image: *const ActqImage) -> Result<Opened, Failure> {
    let image = image.cast::<Opened>();
    let sealed = Buffer::new(image.cast::<usize>(), 1)?;
    // SAFETY: as the caller promises; a word is any bits.
    if unsafe { sealed.read() } != [seal(image, MAGIC)] {
        return Err(Code::NotInitialized.into());
    }
    // SAFETY: only `open` writes this seal, after the image beside it.
    Ok(unsafe { *image })
}

/// Opens the image in `bytes`, of `len` bytes, which begin at a multiple of 4. It checks checksum, layout, bounds and
/// overflow limits. `bytes` must stay where and as they are while `image`, or a head of it, is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_image_open(image: *mut ActqImage, bytes: *const u8, len: usize) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe { open(image, bytes, len, Image::new_checked) }
}

/// Opens an image as `actq_image_open` does, but of its content it checks only the checksum: for an image that
/// `actq export-c`, which checks it, has written into the program. A program that does not call `actq_image_open` is
/// 2.7 KB smaller. Steps of an image that `actq_image_open` refuses give meaningless actions or `ACTQ_DAMAGED`, and may
/// take any time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_image_open_checksummed(
    image: *mut ActqImage,
    bytes: *const u8,
    len: usize,
) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe { open(image, bytes, len, Image::new_checksummed) }
}

/// Opens an image that `parse` takes.
///
/// # Safety
///
/// As for every function.
#[inline(always)]
unsafe fn open(
    to: *mut ActqImage,
    bytes: *const u8,
    len: usize,
    parse: impl FnOnce(&'static [u8]) -> Result<Image<'static>, ImageError>,
) -> ActqStatus {
    let open = || {
        let structure = Buffer::new(to.cast::<usize>(), size_of::<ActqImage>() / size_of::<usize>())?;
        let content = Buffer::new(bytes, len);
        if let Ok(content) = &content {
            apart(&structure.addresses(), &content.addresses())?;
        }
        // From here on the former image is closed, whatever happens.
        // SAFETY: as the caller promises.
        unsafe { structure.write() }.fill(0);
        // SAFETY: as the caller promises.
        let image = parse(unsafe { content?.read() })?;
        let place = to.cast::<Opened>();
        // SAFETY: valid as the words above.
        unsafe { place.write(Opened { seal: seal(place, MAGIC), at: bytes as usize, image }) };
        Ok(())
    };
    status(open())
}

/// Writes what `get` reads of an image to `out`.
///
/// # Safety
///
/// As [`opened`]; `out` is null, misaligned, or valid for a write.
unsafe fn query<T>(
    image: *const ActqImage,
    out: *mut T,
    get: impl FnOnce(Image<'static>) -> Result<T, Failure>,
) -> ActqStatus {
    let query = || {
        // SAFETY: as the caller promises.
        let opened = unsafe { opened(image) }?;
        let out = Buffer::new(out, 1)?;
        all_apart(&[&out.addresses(), &Buffer::new(image, 1)?.addresses(), &opened.bytes()])?;
        // SAFETY: as the caller promises.
        unsafe { out.put(get(opened.image)?) };
        Ok(())
    };
    status(query())
}

/// Gives an image's numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_image_sizes(image: *const ActqImage, sizes: *mut Sizes) -> ActqStatus {
    let get = |image: Image<'static>| {
        Ok(Sizes {
            image_bytes: image.bytes(),
            // One word names the head.
            scratch_words: image.scratch_words() + 1,
            observation_len: image.obs_len(),
            action_len: image.act_len(),
            chunk: image.chunk(),
            execute: image.execute(),
            ports: image.ports().count(),
            rate_hz: image.rate_hz(),
            crc: image.crc(),
        })
    };
    // SAFETY: as the caller promises.
    unsafe { query(image, sizes, get) }
}

/// Gives a policy's name.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_image_name(image: *const ActqImage, name: *mut Text) -> ActqStatus {
    // SAFETY: as the caller promises.
    unsafe { query(image, name, |image| Ok(text(image.name()))) }
}

/// Gives what a step costs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_image_cost(image: *const ActqImage, cost: *mut CCost) -> ActqStatus {
    let get = |image: Image<'static>| {
        let step = image.step_cost();
        Ok(CCost { instructions: step.instructions, cycles: step.cycles, least_budget: image.least_budget() })
    };
    // SAFETY: as the caller promises.
    unsafe { query(image, cost, get) }
}

/// Gives a raw input or target, numbered from 0: the raw inputs in the order of the observation, then the targets in
/// the order of the action. After the last one, and if the image has none, it returns `ACTQ_NO_SUCH_PORT`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_image_port(image: *const ActqImage, number: usize, port: *mut CPort) -> ActqStatus {
    let get = |image: Image<'static>| {
        let (offset, found) = places(image).nth(number).ok_or(Code::NoSuchPort)?;
        let [low, high] = found.range;
        let [name, names] = [found.name, found.names].map(text);
        Ok(CPort { kind: found.kind as u32, offset, len: found.len, low, high, name, names })
    };
    // SAFETY: as the caller promises.
    unsafe { query(image, port, get) }
}

/// Copies `count` values of the raw input with this name to their place in `observation`, which has `len` values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn actq_set_input(
    image: *const ActqImage,
    name: *const c_char,
    values: *const f32,
    count: usize,
    observation: *mut f32,
    len: usize,
) -> ActqStatus {
    let set = || {
        // SAFETY: as the caller promises.
        let opened = unsafe { opened(image) }?;
        let (structure, image) = (image, opened.image);
        if name.is_null() {
            return Err(Code::Null.into());
        }
        let (offset, port) = places(image)
            .take_while(|(_, port)| port.kind == actq_kernels::PortKind::Input)
            // SAFETY: it is not null; the caller promises a zero at its end.
            .find(|(_, port)| unsafe { is_name(name, port.name) })
            .ok_or(Code::NoSuchPort)?;
        if count != port.len || len != image.obs_len() {
            return Err(Code::Length.into());
        }
        let (to, values) = (Buffer::new(observation, len)?, Buffer::or_empty(values, count)?);
        let structure = Buffer::new(structure, 1)?;
        all_apart(&[&to.addresses(), &values.addresses(), &structure.addresses(), &opened.bytes()])?;
        // SAFETY: as the caller promises; they do not overlap.
        let (values, observation) = unsafe { (values.read(), to.write()) };
        observation.iter_mut().skip(offset).zip(values).for_each(|(to, value)| *to = *value);
        Ok(())
    };
    status(set())
}

/// Returns `true` if `name`, up to its zero, is `expected`. It compares byte by byte: `CStr` would call `strlen`.
///
/// # Safety
///
/// `name` has a zero at its end.
unsafe fn is_name(name: *const c_char, expected: &str) -> bool {
    let mut ended = expected.bytes().chain([0]).enumerate();
    // SAFETY: the first byte that differs ends the loop, the zero at the latest; no byte of a port's name is zero.
    ended.all(|(i, byte)| unsafe { name.add(i).read() } as u8 == byte)
}

/// The ports with the index of each one's first value in the observation, or in the action.
fn places(image: Image<'static>) -> impl Iterator<Item = (usize, Port<'static>)> {
    image.ports().scan([0; 2], |next, port| {
        let next = &mut next[usize::from(port.kind != actq_kernels::PortKind::Input)];
        let offset = *next;
        *next += port.len;
        Some((offset, port))
    })
}

fn text(text: &'static str) -> Text {
    Text { data: text.as_ptr().cast(), len: text.len() }
}
