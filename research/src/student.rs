//! A rival: a narrower network of the teacher's structure. It starts at random weights, and learns from the recordings
//! and the teacher's outputs with the noise of the method distill.

pub mod codes;
pub mod fit;
pub mod form;
pub mod recipes;
pub mod rival;
pub mod start;
pub mod widths;

use actq::error::Result;
use actq::graph::narrow::narrowed;
use actq::random::Random;

use form::Form;
use recipes::Start;
use rival::{Rival, Settings, Teacher};
use start::restart;
use widths::format_widths;

/// Adam's rates to choose from; shapes are tried with the first.
const RATES: [f32; 4] = [3e-3, 1e-3, 1e-2, 3e-2];

/// Makes a student within a budget. Its widths (in proportion to the teacher's, to their roots, or equal) and Adam's
/// rate are those with the lowest error on held-out episodes of the calibration recording. `progress` receives
/// the present work and the share of it that is done.
///
/// # Errors
///
/// [`actq::budget::BudgetTooSmall`] if the narrowest student exceeds the budget.
pub fn student(
    teacher: &Teacher<'_>,
    form: Form,
    settings: Settings,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Rival> {
    let shapes = teacher.narrowing(form, settings.budget)?.shapes()?;
    let start = |kept: &Vec<Vec<usize>>| {
        let mut graph = narrowed(teacher.graph, &teacher.ties, kept).graph;
        let units = teacher.units(&graph, settings.seed);
        restart(&mut graph, &units, &mut Random::new(settings.seed));
        Start { graph, units }
    };
    let starts = shapes.iter().map(start).collect::<Vec<Start>>();
    let describe = |start: usize| format_widths(&teacher.ties, &shapes[start]);
    teacher.learned((&starts, &RATES), (form, settings), &describe, progress)
}

#[cfg(test)]
pub(crate) mod tests {
    use actq::budget::Budget;
    use actq::data::Dataset;
    use actq::graph::ops::{Linear, Pointwise};
    use actq::graph::{Graph, Network, WeightMatrix, Weights};
    use actq::measure::eval;
    use actq::methods::distill::train::recorded_error;
    use actq::policy::Policy;
    use actq_kernels::math::Function;

    use super::*;
    use crate::testing::{dataset, lstm};

    /// Makes a network 4 -> 24 tanh -> 20 tanh -> 2.
    pub(crate) fn wide() -> Graph {
        let mut random = Random::new(7);
        let mut graph = Graph::new(4);
        let mut value = 0;
        for (layer, (rows, cols)) in [(24, 4), (20, 24), (2, 20)].into_iter().enumerate() {
            let data = (0..rows * cols).map(|_| random.normal() / (cols as f32).sqrt()).collect();
            let matrix =
                graph.add_matrix(WeightMatrix { name: format!("m{layer}"), rows, cols, data }).expect("a matrix");
            value = graph.add(Linear { matrix, bias: vec![0.1; rows] }, &[value]).expect("it fits");
            if layer < 2 {
                value = graph.add(Pointwise(Function::Tanh), &[value]).expect("it fits");
            }
        }
        graph
    }

    pub(crate) fn settings(bytes: usize, steps: usize) -> Settings {
        Settings { budget: Budget::ImageBytes(bytes), steps: Some(steps), seed: 1 }
    }

    fn made(policy: &Policy, recording: &Dataset, form: Form, settings: Settings) -> Rival {
        let teacher = Teacher::new(policy, &policy.graph, recording);
        student(&teacher, form, settings, &mut |_, _| {}).expect("a student")
    }

    #[test]
    fn a_student_keeps_its_bytes_and_learns() {
        const BYTES: usize = 1200;
        let policy = Policy::of("wide", wide());
        let recording = dataset(&policy.graph, 4, 100);
        let teacher = Teacher::new(&policy, &policy.graph, &recording);
        for form in [Form::Int8, Form::Bits4] {
            let rival = made(&policy, &recording, form, settings(BYTES, 600));
            let image = rival.image.as_ref().expect("an image");
            assert!(image.image.len() <= BYTES && image.image.len() > BYTES * 8 / 10, "{}", image.image.len());
            let error =
                |graph: &Graph| recorded_error(&Network::new(graph), &Weights::of(graph), &teacher.windows, None, 1);
            let mut before = rival.network.clone();
            restart(&mut before, &teacher.units(&rival.network, 1), &mut Random::new(1));
            let (before, after) = (error(&before), error(&rival.network));
            assert!(after < before / 10.0, "{before} to {after}");
            let buffer = image.buffer();
            let image = buffer.image("student".as_ref()).expect("an image");
            let coded = eval::evaluate(image, &recording).expect("errors").nmse;
            let most = if form == Form::Int8 { 1.3 * after + 1e-3 } else { 3.0 * after + 1e-2 };
            assert!(coded < most, "{form:?}: {after} in f32, {coded} in codes");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_image() {
        let policy = Policy::of("lstm", lstm());
        let recording = dataset(&policy.graph, 4, 80);
        let image = |seed: u64| {
            let settings = Settings { seed, ..settings(1000, 24) };
            made(&policy, &recording, Form::Int8, settings).image.expect("an image").image
        };
        assert_eq!(image(1), image(1));
        assert_ne!(image(1), image(2));
    }

    #[test]
    fn a_student_in_f32_has_no_image() {
        let policy = Policy::of("wide", wide());
        let recording = dataset(&policy.graph, 4, 100);
        let rival = made(&policy, &recording, Form::F32, settings(2000, 16));
        assert!(rival.image.is_none());
        assert!(form::taken(&policy, &rival.network, Form::F32).expect("a size").image <= 2000);
    }

    #[test]
    fn too_few_bytes_are_refused() {
        let policy = Policy::of("wide", wide());
        let recording = dataset(&policy.graph, 4, 100);
        let teacher = Teacher::new(&policy, &policy.graph, &recording);
        let error = student(&teacher, Form::Int8, settings(100, 16), &mut |_, _| {}).expect_err("too few");
        assert!(error.budget().is_some_and(|small| small.bytes > 100 && small.bytes < 1000), "{error}");
    }
}
