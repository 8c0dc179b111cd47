//! `actq keygen` and `actq sign`

use actq::runtime::ImageBuffer;
use actq_client::keys;
use anyhow::Result;

use crate::args::link::{KeygenArgs, SignArgs};
use crate::terminal::{print, reserve};

/// Generates a key.
pub(crate) fn keygen(args: &KeygenArgs) -> Result<()> {
    let key = keys::generate()?;
    keys::write(&args.out, &key)?;
    print(&format!("{}: private key\npublic key: {}\n", args.out.display(), keys::public(&key)))
}

/// Signs an image.
pub(crate) fn sign(args: &SignArgs) -> Result<()> {
    let outputs = reserve([&args.out], [&args.image, &args.key])?;
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let signed = keys::sign(&keys::read(&args.key)?, buffer.bytes(), args.version)?;
    outputs.write(&[serde_json::to_string_pretty(&signed)? + "\n"])?;
    print(&format!("{}: {}, version {}, by {}\n", args.out.display(), image.name(), signed.version, signed.public_key))
}
