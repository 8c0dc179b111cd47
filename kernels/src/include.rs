//! An image in the program: aligned, and checked at compile time.

use crate::image::ImageInfo;
use crate::image::features::refusal;

/// Includes an image file, as [`include_bytes!`](core::include_bytes) does, and returns `&'static [u8]`.
///
/// The bytes are aligned to 4, as [`Image::new_checked`](crate::Image::new_checked) needs them. At compile time
/// [`ImageInfo::read`](crate::ImageInfo::read) checks the file: another format version, another kernel layout, a
/// truncated or a damaged file does not compile. Nor does an image that needs a feature of this crate which the build
/// leaves out; the error names the feature. `Image::new_checked` checks the rest at run time.
///
/// A relative path starts at the file that calls the macro.
///
/// ```
/// use actq_kernels::{Head, Image, ImageInfo, include_image};
///
/// static POLICY: &[u8] = include_image!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/valid.actq"));
/// const INFO: ImageInfo = match ImageInfo::read(POLICY) {
///     Ok(info) => info,
///     Err(_) => panic!("`include_image!` has checked it"),
/// };
///
/// // Arrays of the right lengths, without an allocator.
/// let mut scratch = [0; INFO.scratch_words];
/// let mut head = Head::new(Image::new_checked(POLICY)?, &mut scratch)?;
/// let action = head.step(&[0.0; INFO.obs_len])?;
/// assert_eq!(action.len(), INFO.act_len);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A file that is not an image is a compile error:
///
/// ```compile_fail
/// static POLICY: &[u8] = actq_kernels::include_image!(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
/// ```
#[macro_export]
macro_rules! include_image {
    ($path:expr $(,)?) => {{
        static ALIGNED: &$crate::include::Aligned<[u8]> = &$crate::include::Aligned(*::core::include_bytes!($path));
        // The checksum of a large image takes more steps than the lint expects.
        #[allow(long_running_const_eval)]
        const _: () = $crate::include::check(&ALIGNED.0);
        &ALIGNED.0
    }};
}

/// Bytes at an address that is a multiple of 4. Part of the expansion of [`include_image!`](crate::include_image).
#[derive(Debug)]
#[repr(C, align(4))]
pub struct Aligned<T: ?Sized>(pub T);

/// Checks an image at compile time. Part of the expansion of [`include_image!`](crate::include_image).
pub const fn check(bytes: &[u8]) {
    if let Err(error) = ImageInfo::read(bytes) {
        panic!("{}", error.text());
    }
    if let Some(refusal) = refusal(bytes) {
        panic!("{}", refusal);
    }
}
