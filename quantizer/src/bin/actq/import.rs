//! `actq import`

use anyhow::Result;

use crate::args::ImportArgs;
use crate::print;
use actq::import::onnx::{Choice, import};

pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    let choice = Choice { output: args.output.clone(), states: args.state.clone() };
    let imported = import(&args.model, &choice)?;
    print(&format!("{:#?}", imported.inputs))?;
    print(&String::from_utf8_lossy(&imported.json))
}
