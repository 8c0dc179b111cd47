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

/// What stands in a signature's file, as JSON.
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

/// A new key from the system's randomness, in PKCS #8 as PEM.
///
/// # Errors
///
/// Where the system has none to give.
pub fn generate() -> Result<SigningKey> {
    let mut seed = [0; 32];
    getrandom::fill(&mut seed).context("the system gives no random numbers")?;
    Ok(SigningKey::from_bytes(&seed))
}

/// Writes a private key into a new file that only its owner may read. A file that is there is never replaced.
///
/// # Errors
///
/// Where there is a file already, or none can be made.
pub fn write(path: &Path, key: &SigningKey) -> Result<()> {
    let name = path.display();
    let pem = key.to_pkcs8_pem(LineEnding::LF).context("the key cannot be written as PEM")?;
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path);
    let mut file =
        file.with_context(|| format!("{name}: a key needs a new file; one that is there is never replaced"))?;
    file.write_all(pem.as_bytes()).and_then(|()| file.sync_all()).with_context(|| format!("{name}: cannot be written"))
}

/// Reads a private key: PKCS #8 as PEM, as `actq keygen` or `openssl genpkey -algorithm ed25519` writes it.
///
/// # Errors
///
/// Where it is none.
pub fn read(path: &Path) -> Result<SigningKey> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    SigningKey::from_pkcs8_pem(&text).with_context(|| format!("{name}: not an Ed25519 private key in PKCS #8 as PEM"))
}

/// The public key in hexadecimal, as a build takes it.
pub fn public(key: &SigningKey) -> String {
    hexadecimal(key.verifying_key().as_bytes())
}

/// Signs an image of a version.
///
/// # Errors
///
/// None in practice: the context is shorter than RFC 8032 allows.
pub fn sign(key: &SigningKey, image: &[u8], version: u32) -> Result<Signed> {
    let digest = Sha512::new().chain_update(image);
    let signature = key.sign_prehashed(digest, Some(&context(version))).context("the image cannot be signed")?;
    Ok(Signed { version, public_key: public(key), signature: hexadecimal(&signature.to_bytes()) })
}

impl Signed {
    /// The signature's bytes, if it is one of this image by the key that it names.
    ///
    /// # Errors
    ///
    /// Where it is not.
    pub fn check(&self, image: &[u8]) -> Result<[u8; 64]> {
        let key: [u8; 32] = bytes(&self.public_key).context("the public key has not 32 bytes in hexadecimal")?;
        let signature: [u8; 64] = bytes(&self.signature).context("the signature has not 64 bytes in hexadecimal")?;
        let key = VerifyingKey::from_bytes(&key).context("the public key is none")?;
        let digest = Sha512::new().chain_update(image);
        let verified =
            key.verify_prehashed_strict(digest, Some(&context(self.version)), &Signature::from_bytes(&signature));
        ensure!(verified.is_ok(), "the signature is not that of this image and version; sign it again (actq sign)");
        Ok(signature)
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Bytes in hexadecimal; `None` where they are not `N` of them.
fn bytes<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digits = text.as_bytes();
    let mut bytes = [0; N];
    let digit = |at: usize| digits.get(at).and_then(|digit| char::from(*digit).to_digit(16));
    for (i, byte) in bytes.iter_mut().enumerate() {
        *byte = (digit(2 * i)? << 4 | digit(2 * i + 1)?) as u8;
    }
    (digits.len() == 2 * N).then_some(bytes)
}
