//! Authority over the images that may run.

/// Decides by an image's signature. [`Anyone`] requires none, `Key` (feature `signature`) that of one key.
pub trait Authority {
    /// Hash of an image's bytes.
    type Hash;

    /// Starts a hash.
    fn hash(&self) -> Self::Hash;

    /// Adds bytes to a hash.
    fn add(hash: &mut Self::Hash, bytes: &[u8]);

    /// Returns `true` if an image with this hash, version and signature may run.
    fn accepts(&self, hash: Self::Hash, version: u32, signature: Option<&[u8; 64]>) -> bool;
}

/// Authority that accepts every complete image.
#[derive(Clone, Copy, Debug, Default)]
pub struct Anyone;

impl Authority for Anyone {
    type Hash = ();

    fn hash(&self) -> Self::Hash {}

    fn add((): &mut Self::Hash, _: &[u8]) {}

    fn accepts(&self, (): Self::Hash, _: u32, _: Option<&[u8; 64]>) -> bool {
        true
    }
}
