//! The host of jobs: the methods and works of this crate, beside those of `actq`.

use std::io;
use std::path::{Path, PathBuf};

use actq::data::Dataset;
use actq::error::{Error, Result};
use actq::methods::Method;
use actq::policy::Policy;
use actq_cli::commands::jobs::host::Command;
use actq_jobs::error::JobError;
use actq_jobs::host::{Found, Host, Needed, Rolled, Rollout};
use actq_jobs::job::Job;
use actq_jobs::work::Custom;

use crate::actquant::ActQuant;
use crate::actquant::choices::Choices;
use crate::compare;

/// The command `actq-research`.
#[derive(Clone, Copy, Debug)]
pub struct Research;

impl Host for Research {
    fn load(&self, policy: &Path) -> Result<Policy> {
        Command.load(policy)
    }

    fn files(&self, policy: &Path) -> Vec<PathBuf> {
        Command.files(policy)
    }

    fn recorded(&self, policy: &Policy, recording: &Path) -> Result<Dataset> {
        Command.recorded(policy, recording)
    }

    fn method(&self, name: &str) -> Result<Method> {
        let Some(choices) = name.strip_prefix("actquant") else { return Command.method(name) };
        let choices = match choices.strip_prefix(" (").and_then(|text| text.strip_suffix(')')) {
            Some(text) => text.parse().map_err(|error: String| Error::input(format!("method {name:?}: {error}")))?,
            None => Choices::default(),
        };
        let method = Method::custom(ActQuant(choices));
        actq::error::ensure!(method.to_string() == name, "method {name:?} is unknown; its choices are in parentheses");
        Ok(method)
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        Command.write(path, bytes)
    }

    fn drive(&self, rollout: &Rollout<'_>) -> Result<Rolled, JobError> {
        Command.drive(rollout)
    }

    fn custom(
        &self,
        job: &Job,
        work: &Custom,
        needs: &[Needed],
        watch: &mut dyn FnMut(&str, f64),
    ) -> Result<Found, JobError> {
        compare::work(job, work, needs, watch).map_err(|error| {
            let again = error.chain().any(|cause| cause.is::<io::Error>());
            JobError { again, error: Error::other(error) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_found_by_their_names() {
        for choices in [Choices::default(), Choices::AUTHORS, Choices::half()] {
            let method = Method::custom(ActQuant(choices));
            assert_eq!(Research.method(&method.to_string()).expect("known"), method);
        }
        assert_eq!(Research.method("gptq").expect("known"), Method::Gptq);
        for name in ["actquant2", "actquant (head=5)", "rtm"] {
            assert!(Research.method(name).is_err(), "{name}");
        }
    }
}
