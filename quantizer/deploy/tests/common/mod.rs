//! What tests of readers share: published bundles, which are in the folder that `ACTQ_SHARED` names.

use std::path::PathBuf;

use actq::error::{Result, ensure};
use actq_deploy::description::Description;
use actq_deploy::{Answers, Bundle, Plan, Reference, read};

/// Returns the folder of a shared bundle.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    match std::env::var_os("ACTQ_SHARED") {
        Some(folder) => Some(PathBuf::from(folder).join("bundles").join(name)),
        None => {
            println!("not run: ACTQ_SHARED does not name the shared folder");
            None
        }
    }
}

/// Asserts that a bundle agrees with its reference, with the family's profile accepted.
pub(crate) fn agrees(name: &str, answers: &str) -> Result<()> {
    let Some(folder) = shared(name) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, true, Answers::parse(answers)?)?;
    ensure!(reading.questions.is_empty(), "{name}: {:#?}", reading.questions);
    let text = reading.description.to_toml(&reading.sources)?;
    ensure!(
        Description::parse(&text)? == reading.description,
        "{name}: deploy.toml does not keep the description: {text}"
    );
    let reference = Reference::read(&folder.join("raw.npz"), &folder.join("expect.npz"))?;
    let comparison = reference.compare(Plan::new(&reading.description, &bundle)?)?;
    println!("{name}: {:?}, unread {:?}", comparison.largest, reading.unread);
    ensure!(reading.unread.is_empty(), "{name}: nothing reads {:?}", reading.unread);
    comparison.require_equal()
}
