//! Key files and signatures.

use std::fs;

use actq_client::keys::{Signed, generate, public, read, sign, write};

/// RFC 8410, section 10.3: a private key, and its public one from section 10.1.
const PEM: &str = "-----BEGIN PRIVATE KEY-----\nMC4CAQAwBQYDK2VwBCIEINTuctv5E1hK1bbY8fdp+K06/nwoy/HU++CXqI9EdVhC\n-----END PRIVATE KEY-----\n";
const PUBLIC: &str = "19bf44096984cdfe8541bac167dc3b96c85086aa30b6b6cb0c5c38ad703166e1";

#[test]
fn only_its_owner_reads_a_key_never_replaced() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("key.pem");
    let key = generate().expect("the system has random numbers");
    write(&path, &key).expect("the file is new");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        assert_eq!(fs::metadata(&path).expect("the file exists").permissions().mode() & 0o777, 0o600);
    }
    assert_eq!(read(&path).expect("the file is a key").to_bytes(), key.to_bytes());
    let other = generate().expect("the system has random numbers");
    assert_ne!(other.to_bytes(), key.to_bytes());
    let error = write(&path, &other).expect_err("there is a key already");
    assert!(format!("{error:#}").contains("never replaced"), "{error:#}");
    assert_eq!(read(&path).expect("the file is a key").to_bytes(), key.to_bytes());
}

#[test]
fn only_keys_in_pkcs8_are_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("key.pem");
    fs::write(&path, PEM).expect("the folder is writable");
    assert_eq!(public(&read(&path).expect("the file is a key")), PUBLIC);
    for text in ["", "key", PUBLIC, &PEM.replace("MC4C", "MC4D"), &PEM.replace("PRIVATE", "PUBLIC")] {
        fs::write(&path, text).expect("the folder is writable");
        let error = format!("{:#}", read(&path).expect_err("the file is not a key"));
        assert!(error.contains("key.pem") && error.contains("PKCS #8"), "{error}");
    }
}

#[test]
fn a_signature_binds_image_version_and_key() {
    let key = generate().expect("the system has random numbers");
    let signed = sign(&key, b"image", 3).expect("the image is signed");
    signed.check(b"image").expect("the signature is valid");
    let other = public(&generate().expect("the system has random numbers"));
    let wrong = [
        (Signed { version: 4, ..signed.clone() }, &b"image"[..]),
        (Signed { public_key: other, ..signed.clone() }, b"image"),
        (Signed { public_key: "zz".repeat(32), ..signed.clone() }, b"image"),
        (Signed { signature: signed.signature[2..].to_owned(), ..signed.clone() }, b"image"),
        (Signed { signature: signed.signature.clone() + "00", ..signed.clone() }, b"image"),
        (Signed { signature: signed.signature.replace(['0', '1', '2'], "3"), ..signed.clone() }, b"image"),
        (signed, b"imag"),
    ];
    for (signed, image) in wrong {
        let error = format!("{:#}", signed.check(image).expect_err("the signature is another one"));
        assert!(error.contains("sign the image again"), "{signed:?}: {error}");
    }
}
