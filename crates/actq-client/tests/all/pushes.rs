//! Images over the link.

use std::sync::atomic::Ordering;
use std::time::Duration;

use actq_client::keys;
use actq_client::push::{Package, Push, axes_note, push};
use actq_controller::slots::{Anyone, Key};
use actq_controller::{Axis, SafeAction};
use actq_link::code::Refusal;

use crate::requests::{arm, observe_until_fresh};
use crate::simulated::{GOOD, Simulated};

fn image(seed: u8, words: usize) -> Vec<u8> {
    let rest = (0..4 * words).map(|i| (i * 13) as u8 ^ seed);
    GOOD.iter().copied().chain(rest).collect()
}

#[test]
fn images_survive_a_faulty_line_and_a_reset() {
    let controller = Simulated::start(100, || Anyone);
    let mut client = controller.client();
    for (version, image) in [(1, image(1, 700)), (2, image(2, 1500)), (2, image(3, 2))] {
        let mut taken_bytes = Vec::new();
        let package = Package { image: &image, version, signature: None };
        push(&mut client, &package, |taken| taken_bytes.push(taken)).expect("the image is valid");
        assert_eq!(controller.image(), image);
        assert_eq!((taken_bytes.first(), taken_bytes.last()), (Some(&0), Some(&image.len())));
        assert!(taken_bytes.is_sorted(), "{taken_bytes:?}");
    }
    let starts = controller.control.starts.load(Ordering::Relaxed);
    controller.control.reset.store(true, Ordering::Relaxed);
    while controller.control.starts.load(Ordering::Relaxed) == starts {
        std::thread::sleep(Duration::from_millis(1));
    }
    let old = Package { image: &image(4, 10), version: 1, signature: None };
    let error = push(&mut client, &old, |_| ()).expect_err("its version is too low");
    assert!(format!("{error:#}").contains(&Refusal::Rollback.to_string()), "{error:#}");
}

#[test]
fn refused_pushes_give_reasons_and_change_nothing() {
    let controller = Simulated::start(0, || Anyone);
    let mut client = controller.client();
    let good = image(1, 100);
    push(&mut client, &Package { image: &good, version: 3, signature: None }, |_| ()).expect("the image is valid");
    let bad = [b"evil", &good[4..]].concat();
    let cases = [
        (&bad[..], 3, Refusal::SelfTest),
        (&[][..], 3, Refusal::Length),
        (&good[..401], 3, Refusal::Length),
        (&[1; 9000][..], 3, Refusal::Length),
        (&good[..], 2, Refusal::Rollback),
    ];
    for (image, version, why) in cases {
        let error =
            push(&mut client, &Package { image, version, signature: None }, |_| ()).expect_err(&why.to_string());
        assert!(format!("{error:#}").contains(&why.to_string()), "{error:#}");
        assert_eq!(controller.image(), good);
    }
    observe_until_fresh(&mut client);
    client.arm().expect("the controller may be armed");
    let error = push(&mut client, &Package { image: &good, version: 3, signature: None }, |_| ());
    let error = format!("{:#}", error.expect_err("it is armed"));
    // The observations may already be too old.
    assert!(error.contains(&Refusal::Armed.to_string()) || error.contains(&Refusal::Token.to_string()), "{error}");
}

#[test]
fn axes_without_limits_are_noted_before_a_push() {
    let axis = Axis::new(-1.0, 1.0, 0.05, 0.0, SafeAction::Coast).expect("the axis is valid");
    let cases = [([axis; 2], None), ([axis, Axis::STILL], Some("axis 1")), ([Axis::STILL; 2], Some("axis 0, axis 1"))];
    for (axes, named) in cases {
        let controller = Simulated::start_with(axes, 0, || Anyone);
        let note = axes_note(&mut controller.client()).expect("the controller answers");
        let expected = named.map(|axes| format!("the controller will refuse to arm, {axes}: {}", Refusal::Limits));
        assert_eq!(note, expected);
    }
}

/// After a disarm during an update, the controller is busy until a tick switches its outputs off; the update then
/// continues.
#[test]
fn a_push_continues_after_a_disarm() {
    let controller = Simulated::start(0, || Anyone);
    let mut client = controller.client();
    let image = image(1, 400);
    let mut push =
        Push::new(&mut client, Package { image: &image, version: 1, signature: None }).expect("the controller answers");
    while push.taken() == 0 {
        push.advance(&mut client).expect("the image fits");
    }
    arm(&mut client);
    controller.control.hold.store(true, Ordering::Relaxed);
    client.disarm().expect("a disarm is never refused");
    let control = controller.control.clone();
    let tick = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(200));
        control.hold.store(false, Ordering::Relaxed);
    });
    let taken = push.taken();
    push.advance(&mut client).expect("the request waits for the tick");
    assert!(push.taken() > taken && !controller.control.hold.load(Ordering::Relaxed));
    tick.join().expect("the thread ends");
    while !push.advance(&mut client).expect("the update continues") {}
    assert_eq!(controller.image(), image);
}

#[test]
fn a_build_with_a_key_takes_signed_images() {
    let key = keys::generate().expect("the system has random numbers");
    let public = *key.verifying_key().as_bytes();
    let controller = Simulated::start(0, move || Key::new(&public).expect("the bytes are a key"));
    let mut client = controller.client();
    let image = image(1, 100);
    let signed = keys::sign(&key, &image, 7).expect("the image is signed");
    let signature = signed.check(&image).expect("the signature is the image's");
    let mut pushed = |version, signature| push(&mut client, &Package { image: &image, version, signature }, |_| ());
    for (version, signature) in [(7, None), (8, Some(&signature)), (7, Some(&[9; 64]))] {
        let error = format!("{:#}", pushed(version, signature).expect_err("it is not signed so"));
        assert!(error.contains(&Refusal::Signature.to_string()), "{error}");
    }
    pushed(7, Some(&signature)).expect("the image is signed");
    assert_eq!(controller.image(), image);
}
