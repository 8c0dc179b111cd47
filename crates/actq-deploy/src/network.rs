//! Networks of ONNX files, in f32.

use std::collections::BTreeSet;
use std::rc::Rc;

use actq::error::{Context as _, Result, ensure};
use actq::graph::{Network, State, Weights, zero_state};
use actq::policy::Policy;
use actq_onnx::{ImportOptions, OnnxFile};

use crate::sources::{Compute, Part};

/// An ONNX file's graph, one policy for each of its outputs. Clones share the weights and not the recurrent state.
#[derive(Clone, Debug)]
pub(crate) struct OnnxNetwork {
    inputs: Vec<(String, usize)>,
    /// Inputs that cells keep, and the outputs of their next values.
    states: Vec<(String, String)>,
    lens: Vec<usize>,
    outputs: Vec<Output>,
    /// What the file's nodes do with NaN and infinity, and the operations here do not.
    pub(crate) guards: BTreeSet<String>,
}

/// An output and the inputs that it depends on.
#[derive(Clone, Debug)]
struct Output {
    policy: Rc<Policy>,
    /// The same with the contract in its graph.
    inner: Rc<Policy>,
    weights: Rc<Weights>,
    state: State,
    /// Numbers of the file's inputs, in the order of its observation.
    reads: Vec<usize>,
}

impl OnnxNetwork {
    /// Opens a file for these outputs.
    pub(crate) fn open(file: &OnnxFile, outputs: &[String]) -> Result<Self> {
        let path = file.path();
        ensure!(!outputs.is_empty(), "nothing reads an output of it; remove it");
        let signature = file.signature();
        let mut lens = vec![None; signature.inputs.len()];
        let (mut opened, mut states, mut guards) = (Vec::new(), Vec::new(), BTreeSet::new());
        for name in outputs {
            let read = |is_inner| -> Result<_> {
                let options =
                    ImportOptions { output: Some(name.clone()), is_fed: true, is_inner, ..ImportOptions::default() };
                let imported = file.import(&options)?;
                let policy = imported.source.policy_without_digest(path, path)?;
                Ok((imported, Rc::new(policy)))
            };
            let (imported, policy) = read(false)?;
            let has_contract = policy.contract.arrays().iter().any(|(_, array)| array.is_some());
            let inner = if has_contract { read(true)?.1 } else { policy.clone() };
            guards.extend(imported.guards);
            let mut reads = Vec::new();
            for (input, len) in &imported.inputs {
                let at = signature.inputs.iter().position(|(name, _)| name == input);
                let at = at.with_context(|| format!("{}: there is no input {input:?}", path.display()))?;
                lens[at] = Some(*len);
                reads.push(at);
            }
            states.extend(imported.states.into_iter().map(|(input, output, _)| (input, output)));
            let (weights, state) = (Weights::of(&policy.graph), zero_state(&policy.graph, 1));
            opened.push(Output { policy, inner, weights: Rc::new(weights), state, reads });
        }
        // Inputs that no output depends on are left out, and the others move up.
        let used: Vec<usize> = (0..lens.len()).filter(|i| lens[*i].is_some()).collect();
        for output in &mut opened {
            for read in &mut output.reads {
                *read = used.iter().position(|i| i == read).unwrap_or(0);
            }
        }
        let inputs = used.iter().filter_map(|&i| Some((signature.inputs[i].0.clone(), lens[i]?))).collect();
        let lens = opened.iter().map(|output| output.policy.chunk * output.policy.act_len).collect();
        Ok(Self { inputs, states, lens, outputs: opened, guards })
    }
}

impl Compute for OnnxNetwork {
    fn inputs(&self) -> &[(String, usize)] {
        &self.inputs
    }

    fn states(&self) -> &[(String, String)] {
        &self.states
    }

    fn outputs(&self) -> &[usize] {
        &self.lens
    }

    fn part(&self, output: usize) -> Option<Part<'_>> {
        let output = self.outputs.get(output)?;
        Some(Part { policy: &output.policy, inner: &output.inner.graph, reads: &output.reads })
    }

    fn reset(&mut self) {
        for output in &mut self.outputs {
            output.state = zero_state(&output.policy.graph, 1);
        }
    }

    fn step(&mut self, inputs: &[Vec<f32>]) -> Vec<Vec<f32>> {
        self.outputs.iter_mut().map(|output| output.step(inputs)).collect()
    }
}

impl Output {
    fn step(&mut self, inputs: &[Vec<f32>]) -> Vec<f32> {
        let obs: Vec<f32> = self.reads.iter().flat_map(|i| inputs[*i].iter().copied()).collect();
        let pass = Network::new(&self.policy.graph).forward_one(&self.weights, &obs, &mut self.state);
        // The importer made the contract of the graph's last operations.
        let Policy { act_len, contract, .. } = &*self.policy;
        pass.iter().enumerate().map(|(i, value)| contract.apply(i % act_len, *value)).collect()
    }
}
