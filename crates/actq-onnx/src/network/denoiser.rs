//! The network of a flow or a diffusion policy: which of its inputs are the iterate and the time.

use actq::error::{Result, bail, ensure};
use actq::import::Sampler;
use actq::text::printable;

use super::options::listed;
use crate::file::model::{Model, Port};

/// The inputs of a denoiser that are not observed, and what they are in the steps.
#[derive(Clone, Debug)]
pub struct Denoiser {
    /// Name of the input that is the iterate.
    pub iterate: String,
    /// Name of the input that is the time.
    pub time: String,
    /// The time of each evaluation.
    pub times: Vec<f64>,
    /// Limit of the network's iterate.
    pub clip_iterate: Option<f64>,
}

/// Indices of these inputs in the graph.
#[derive(Clone, Copy)]
pub(super) struct Places {
    time: usize,
    pub(super) iterate: usize,
}

impl Places {
    /// Finds them among the inputs that the output of `len` values reads.
    pub(super) fn find(model: &Model, read: &[usize], len: usize, sampler: &Sampler) -> Result<Self> {
        let ports = &model.graph.inputs;
        let iterate = one(ports, read, ("iterate_input", sampler.iterate.as_deref()), len)?;
        let others: Vec<usize> = read.iter().copied().filter(|i| *i != iterate).collect();
        let time = one(ports, &others, ("time_input", sampler.time.as_deref()), 1)?;
        Ok(Self { time, iterate })
    }

    /// Orders inputs as the policy's network reads them: the observation, the time, the iterate.
    pub(super) fn order(self, read: &[usize]) -> Vec<usize> {
        let Self { time, iterate } = self;
        read.iter().copied().filter(|i| ![time, iterate].contains(i)).chain([time, iterate]).collect()
    }

    /// Names the inputs.
    pub(super) fn named(self, model: &Model, sampler: &Sampler) -> Result<Denoiser> {
        let name = |i: usize| model.graph.inputs[i].name.clone();
        let (iterate, time) = (name(self.iterate), name(self.time));
        Ok(Denoiser { iterate, time, times: sampler.times()?, clip_iterate: sampler.clip_iterate() })
    }
}

/// Returns the input that the sampler names by this key, or else the only one of this length.
fn one(ports: &[Port], read: &[usize], (key, name): (&str, Option<&str>), len: usize) -> Result<usize> {
    let is_it = |i: &&usize| name.map_or(ports[**i].len() == Some(len), |name| ports[**i].name == name);
    let found: Vec<usize> = read.iter().filter(is_it).copied().collect();
    let names = |which: &[usize]| listed(which.iter().map(|i| &ports[*i]));
    let &[found] = &found[..] else {
        let why = match (name, &found[..]) {
            (Some(name), _) => format!("names {:?}, which is none of them", printable(name)),
            (None, []) => format!("is missing, and none of them has {len} values"),
            (None, several) => format!("is missing, and may be {}", names(several)),
        };
        bail!("the output reads the inputs {}; the sampler's {key} {why}", names(read))
    };
    let port = &ports[found];
    let is_fit = port.len() == Some(len);
    ensure!(is_fit, "{key} {:?} has the shape {:?}, not {len} values", printable(&port.name), port.shape);
    Ok(found)
}
