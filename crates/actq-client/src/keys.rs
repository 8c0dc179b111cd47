//! Keys and signatures of images: Ed25519ph (RFC 8032) over an image's bytes, with its version in the context.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use actq_controller::slots::context;
use anyhow::{Context as _, Result, ensure};
use ed25519_dalek::pkcs8::spki::der::pem::LineEnding;
use ed25519_dalek::pkcs8::{DecodePrivateKey as _, EncodePrivateKey as _};
use ed25519_dalek::{Digest as _, Sha512, Signature, SigningKey, VerifyingKey};
use serde::{Deserialize, Serialize};

/// Content of a signature's file, as JSON.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Signed {
    /// The image's version.
    pub version: u32,
    /// The public key, hexadecimal.
    pub public_key: String,
    /// The signature, hexadecimal.
    pub signature: String,
}

/// Generates a key from the system's random numbers.
///
/// # Errors
///
/// Fails if the system provides no random numbers.
pub fn generate() -> Result<SigningKey> {
    let mut seed = [0; 32];
    getrandom::fill(&mut seed).context("the system provides no random numbers")?;
    Ok(SigningKey::from_bytes(&seed))
}

/// Writes a private key to a new file that only its owner may read. An existing file is never replaced.
///
/// # Errors
///
/// Fails if the file exists or cannot be created.
pub fn write(path: &Path, key: &SigningKey) -> Result<()> {
    let name = path.display();
    let pem = key.to_pkcs8_pem(LineEnding::LF).context("cannot encode the key as PEM")?;
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path);
    let mut file =
        file.with_context(|| format!("{name}: cannot create the key's file; an existing file is never replaced"))?;
    let written = file.write_all(pem.as_bytes()).and_then(|()| file.sync_all());
    if written.is_err() {
        // It is this call's own, and would block the next try.
        drop(std::fs::remove_file(path));
    }
    written.with_context(|| format!("{name}: cannot write the file"))
}

/// Reads a private key: PKCS #8 as PEM, as `actq keygen` or `openssl genpkey -algorithm ed25519` writes it.
///
/// # Errors
///
/// Fails if the file is not one.
pub fn read(path: &Path) -> Result<SigningKey> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot read the file"))?;
    SigningKey::from_pkcs8_pem(&text).with_context(|| {
        format!("{name}: is not an Ed25519 private key in PKCS #8 as PEM; make one with `actq keygen`")
    })
}

/// Returns the public key in hexadecimal, as a build takes it.
pub fn public(key: &SigningKey) -> String {
    hexadecimal(key.verifying_key().as_bytes())
}

/// Signs an image with its version.
///
/// # Errors
///
/// Never fails in practice: the context is shorter than RFC 8032 allows.
pub fn sign(key: &SigningKey, image: &[u8], version: u32) -> Result<Signed> {
    let digest = Sha512::new().chain_update(image);
    let signature = key.sign_prehashed(digest, Some(&context(version))).context("cannot sign the image")?;
    Ok(Signed { version, public_key: public(key), signature: hexadecimal(&signature.to_bytes()) })
}

impl Signed {
    /// Verifies that the signature is one of this image by the key that it names, and returns its bytes.
    ///
    /// # Errors
    ///
    /// Fails if it is not.
    pub fn check(&self, image: &[u8]) -> Result<[u8; 64]> {
        let damaged = |what: &str| format!("{what}; sign the image again (actq sign)");
        let key: [u8; 32] =
            bytes(&self.public_key).with_context(|| damaged("the public key is not 32 bytes in hexadecimal"))?;
        let signature: [u8; 64] =
            bytes(&self.signature).with_context(|| damaged("the signature is not 64 bytes in hexadecimal"))?;
        let key = VerifyingKey::from_bytes(&key).with_context(|| damaged("the public key is not an Ed25519 key"))?;
        let digest = Sha512::new().chain_update(image);
        let verified =
            key.verify_prehashed_strict(digest, Some(&context(self.version)), &Signature::from_bytes(&signature));
        ensure!(
            verified.is_ok(),
            "the signature does not match this image and version; sign the image again (actq sign)"
        );
        Ok(signature)
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Parses `N` bytes in hexadecimal; `None` for another length.
fn bytes<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digits = text.as_bytes();
    let mut bytes = [0; N];
    let digit = |at: usize| digits.get(at).and_then(|digit| char::from(*digit).to_digit(16));
    for (i, byte) in bytes.iter_mut().enumerate() {
        *byte = (digit(2 * i)? << 4 | digit(2 * i + 1)?) as u8;
    }
    (digits.len() == 2 * N).then_some(bytes)
}
