//! Published bundles against the references of their deploy code. They run where `ACTQ_SHARED` names the folder of the
//! bundles.

use std::path::PathBuf;

use actq::error::{Result, ensure};
use actq_deploy::{Answers, Bundle, Plan, Reference, read};

fn shared(name: &str) -> Option<PathBuf> {
    match std::env::var_os("ACTQ_SHARED") {
        Some(folder) => Some(PathBuf::from(folder).join("bundles").join(name)),
        None => {
            println!("not run: ACTQ_SHARED does not name the shared folder");
            None
        }
    }
}

fn agrees(name: &str, answers: &str) -> Result<()> {
    let Some(folder) = shared(name) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, true, Answers::parse(answers)?)?;
    ensure!(reading.questions.is_empty(), "{name}: {:#?}", reading.questions);
    let reference = Reference::read(&folder.join("raw.npz"), &folder.join("expect.npz"))?;
    let comparison = reference.compare(Plan::new(&reading.description, &bundle)?)?;
    println!("{name}: {:?}, unread {:?}", comparison.largest, reading.unread);
    comparison.require_equal()
}

#[test]
fn unitree_rl_lab_agrees_with_its_deploy_code() -> Result<()> {
    agrees("unitree_lab_g1_velocity", "")
}
