//! Images signed with one key.

use core::fmt;

use salty::{PublicKey, Sha512, Signature};

use super::authority::Authority;

/// Authority that accepts images signed with one key: Ed25519ph (RFC 8032) with [`context`].
pub struct Key(PublicKey);

/// The bytes are not a point of the curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadKey;

impl fmt::Display for BadKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("not an Ed25519 public key; `actq keygen` makes one")
    }
}

impl core::error::Error for BadKey {}

impl Key {
    /// Reads a key from these bytes, as `actq keygen` prints them.
    ///
    /// # Errors
    ///
    /// Fails if they are not a key.
    pub fn new(bytes: &[u8; 32]) -> Result<Self, BadKey> {
        PublicKey::try_from(bytes).map(Self).map_err(|_| BadKey)
    }

    /// Parses 64 hexadecimal digits; `None` for any other text. It is `const`, so that a build with an invalid key
    /// fails.
    pub const fn parse(text: &str) -> Option<[u8; 32]> {
        let (pairs, rest) = text.as_bytes().as_chunks();
        if pairs.len() != 32 || !rest.is_empty() {
            return None;
        }
        let (mut key, mut i) = ([0; 32], 0);
        while i < key.len() {
            let [high, low]: [u8; 2] = pairs[i];
            let (Some(high), Some(low)) = ((high as char).to_digit(16), (low as char).to_digit(16)) else {
                return None;
            };
            key[i] = (high << 4 | low) as u8;
            i += 1;
        }
        Some(key)
    }
}

/// Returns the signature's context: a constant text and the image's version.
pub fn context(version: u32) -> [u8; 14] {
    let mut context = *b"actq image    ";
    if let Some(place) = context.last_chunk_mut() {
        *place = version.to_le_bytes();
    }
    context
}

impl Authority for Key {
    type Hash = Sha512;

    fn hash(&self) -> Self::Hash {
        Sha512::new()
    }

    fn add(hash: &mut Self::Hash, bytes: &[u8]) {
        hash.update(bytes);
    }

    fn accepts(&self, hash: Self::Hash, version: u32, signature: Option<&[u8; 64]>) -> bool {
        let Some(signature) = signature else { return false };
        let (digest, context) = (hash.finalize(), context(version));
        self.0.verify_prehashed(&digest, &Signature::from(signature), Some(&context)).is_ok()
    }
}
