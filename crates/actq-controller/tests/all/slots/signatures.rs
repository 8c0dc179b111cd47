//! Images signed with one key, by a different implementation than the one that verifies.

use actq_controller::slots::{Key, Layout, context};
use actq_link::code::Refusal;
use actq_testkit::Nor;
use ed25519_dalek::{Digest as _, Sha512, SigningKey};

use super::device::{Device, Image};

type Flash = Nor<4, 1024>;

fn sign(key: &SigningKey, image: &Image, version: u32) -> [u8; 64] {
    let digest = Sha512::new().chain_update(&image.bytes);
    key.sign_prehashed(digest, Some(&context(version))).expect("the context is short").to_bytes()
}

fn authority(key: &SigningKey) -> Key {
    Key::new(key.verifying_key().as_bytes()).expect("the key is a point of the curve")
}

#[test]
fn only_signed_images_run() {
    let (key, stranger) = (SigningKey::from_bytes(&[7; 32]), SigningKey::from_bytes(&[8; 32]));
    let mut flash = Flash::new(4, 9);
    let layout = Layout::new(&flash, 0..2048, 2048..4096).expect("the slots are valid");
    let image = Image::new(130, 3, true);
    let good = sign(&key, &image, 3);
    let mut device = Device::start(&mut flash, &layout, authority(&key));
    assert_eq!(device.update(&image, 64, None), Err(Refusal::Signature));
    assert_eq!(device.update(&image, 64, Some(&sign(&stranger, &image, 3))), Err(Refusal::Signature));
    assert_eq!(device.update(&image, 64, Some(&sign(&key, &image, 4))), Err(Refusal::Signature), "another version");
    let other = Image::new(131, 3, true);
    assert_eq!(device.update(&other, 64, Some(&good)), Err(Refusal::Signature), "another image");
    for bit in 0..512 {
        let mut damaged = good;
        damaged[bit / 8] ^= 1 << (bit % 8);
        if bit % 37 == 0 {
            assert_eq!(device.update(&image, 400, Some(&damaged)), Err(Refusal::Signature), "bit {bit}");
        }
    }
    assert_eq!(device.runs, None);
    assert_eq!(device.update(&image, 64, Some(&good)), Ok(()));
    drop(device);
    assert_eq!(Device::start(&mut flash, &layout, authority(&key)).runs, Some(image.bytes), "verified at every start");
    assert_eq!(Device::start(&mut flash, &layout, authority(&stranger)).runs, None, "a build with another key");
}

#[test]
fn invalid_keys_are_refused() {
    assert!((0..=255).any(|byte| Key::new(&[byte; 32]).is_err()));
}

#[test]
fn a_key_is_64_hexadecimal_digits() {
    let text = "00ff".to_owned() + &"0a".repeat(28) + "Bc10";
    let key = Key::parse(&text).expect("a key");
    assert_eq!((key[..3].to_vec(), &key[30..]), (vec![0, 0xff, 10], &[0xbc, 0x10][..]));
    assert_eq!((Key::parse(""), Key::parse(&text[1..]), Key::parse(&text[2..])), (None, None, None));
    assert_eq!((Key::parse(&(text.clone() + "0")), Key::parse(&(text.clone() + "00"))), (None, None));
    assert_eq!((Key::parse(&text.replace('f', "g")), Key::parse(&text.replace("ff", "\u{e9}"))), (None, None));
}
