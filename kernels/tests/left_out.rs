//! A build without some of the features refuses an image that needs them, and takes the same image with them.

use actq_kernels::{Image, ImageError};

#[repr(align(4))]
struct Aligned<const N: usize>([u8; N]);

/// An image with every kind of section. It needs the features below.
static VALID: Aligned<{ include_bytes!("valid.actq").len() }> = Aligned(*include_bytes!("valid.actq"));

#[test]
fn images_beyond_the_build_are_refused() {
    let all = cfg!(all(
        feature = "w2",
        feature = "w3",
        feature = "w4",
        feature = "w8",
        feature = "single",
        feature = "paired",
        feature = "groups",
        feature = "elu",
        feature = "norm",
        feature = "recurrent",
        feature = "chunks"
    ));
    for parse in [Image::new_checked, Image::new_checksummed] {
        match parse(&VALID.0) {
            Ok(_) => assert!(all, "a build without some features takes the image"),
            Err(error) => assert!(!all && error == ImageError::LeftOut, "{error}"),
        }
    }
}
