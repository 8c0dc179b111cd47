//! A network to learn: a shape, and what learning starts from.

use std::borrow::Cow;

use super::compact::{Compacted, compact};
use super::objective::Frames;
use super::shape::{Shape, Target, shape};
use super::train::Task;
use crate::calibrate::moments::Moments;
use crate::error::Result;
use crate::methods::learning::Recipe;

/// A network to learn.
#[derive(Debug)]
pub(super) struct Candidate {
    pub(super) shape: Shape,
    pub(super) compacted: Compacted,
    /// Importance of the remaining columns of every matrix.
    pub(super) importance: Vec<Vec<f64>>,
}

impl Candidate {
    /// Chooses the shape and removes what it lacks.
    ///
    /// # Errors
    ///
    /// As [`shape`].
    pub(super) fn new(goal: Target<'_>, recipe: Recipe) -> Result<Self> {
        let shape = shape(goal, recipe)?;
        let (cut, moments) = (&shape.cut, &goal.statistics.moments);
        let inputs =
            moments.iter().zip(&cut.columns).map(|((input, _), columns)| match columns.len() == input.mean.len() {
                true => Cow::Borrowed(input),
                false => Cow::Owned(input.of(columns)),
            });
        let inputs: Vec<Cow<'_, Moments>> = inputs.collect();
        let inputs: Vec<&Moments> = inputs.iter().map(AsRef::as_ref).collect();
        let mut compacted = compact(&cut.graph, &shape.dimensions, &shape.widths, &inputs);
        for (of_compacted, of_cut) in [(&mut compacted.columns, &cut.columns), (&mut compacted.rows, &cut.rows)] {
            let of_matrices = of_compacted.iter_mut().zip(of_cut);
            of_matrices.for_each(|(kept, former)| kept.iter_mut().for_each(|index| *index = former[*index]));
        }
        let of_matrices = compacted.columns.iter().zip(&goal.statistics.inputs);
        let importance =
            of_matrices.map(|(columns, importance)| columns.iter().map(|&c| importance[c]).collect()).collect();
        Ok(Self { shape, compacted, importance })
    }

    /// Returns the task to learn it.
    pub(super) fn task<'a>(&'a self, goal: Target<'a>, recipe: Recipe) -> Task<'a> {
        let Target { statistics, options, .. } = goal;
        Task {
            graph: &self.compacted.graph,
            widths: &self.compacted.widths,
            group: options.group,
            importance: &self.importance,
            x_max: &self.shape.limits,
            recipe,
            frames: Frames::of(options, statistics.graph()),
            watched: statistics.watched.as_ref(),
            bounds: statistics.bounds(options),
            seed: options.seed,
        }
    }
}
