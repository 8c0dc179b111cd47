//! A method with all that it needs to know about the recorded observations.

use anyhow::{Result, ensure};

use super::actquant::Statistics;
use super::moments::{Moments, collect};
use super::{Activations, Budget, Method, Options, Outcome, actquant, quantize};
use crate::dataset::Dataset;
use crate::graph::Graph;
use crate::policy::Policy;

/// A method made ready once, to quantize for any number of budgets.
#[derive(Clone, Debug)]
pub struct Prepared {
    method: Method,
    /// Of every matrix's input; empty where the method needs none.
    pub moments: Vec<Moments>,
    /// Of ActQuant; otherwise `None`.
    pub actquant: Option<Statistics>,
}

impl Prepared {
    /// Reads `calib.npz` of the policy's folder if the method needs it, and collects. `progress` gets the share done.
    pub fn new(policy: &Policy, method: Method, mut progress: impl FnMut(f64)) -> Result<Self> {
        let graph = &policy.graph;
        let calib = || -> Result<Dataset> {
            let path = policy.dir.join("calib.npz");
            ensure!(path.exists(), "{method} needs recorded observations: put calib.npz beside policy.json");
            Dataset::load(&path, graph.obs_len, policy.chunk * policy.act_len)
        };
        let mut prepared = Self { method, moments: Vec::new(), actquant: None };
        match method {
            Method::Rtn => {}
            Method::Gptq => {
                let dataset = calib()?;
                let all = dataset.frames().max(1) as f64;
                prepared.moments = collect(graph, &dataset, |frames| progress(frames as f64 / all));
            }
            Method::ActQuant => prepared.actquant = Some(Statistics::collect(graph, &calib()?, progress)?),
        }
        Ok(prepared)
    }

    /// Quantizes every matrix; without a `group`, with the method's own ([`Method::default_group`]).
    pub fn quantize(
        &self,
        graph: &Graph,
        budget: Budget,
        group: Option<usize>,
        activations: Activations,
    ) -> Result<Vec<Outcome>> {
        let group = group.unwrap_or(self.method.default_group());
        let options = Options { method: self.method, budget, group, activations };
        match &self.actquant {
            Some(statistics) => actquant::quantize(graph, statistics, &options),
            None => quantize(graph, &self.moments, &options),
        }
    }
}
