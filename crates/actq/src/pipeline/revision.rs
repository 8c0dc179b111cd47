//! The revision of the images that this library makes.

/// Number of the methods, of all that the pipeline does with them, and of the image's form. It is raised whenever the
/// same policy, recordings and options give other bytes than before: results of another revision must not be taken for
/// those of this one.
pub const REVISION: u32 = 15;

#[cfg(test)]
mod tests {
    use actq_kernels::Width;
    use sha2::{Digest as _, Sha256};

    use super::REVISION;
    use crate::budget::Budget;
    use crate::data::{Dataset, Recordings};
    use crate::graph::Graph;
    use crate::graph::ops::{LayerNorm, Linear};
    use crate::measure::size::hex;
    use crate::methods::{Method, Options};
    use crate::pipeline::quantize;
    use crate::policy::Policy;
    use crate::testing;

    /// The SHA-256 of all images below, at this revision.
    const DIGEST: (u32, &str) = (15, "c8c1f6423061830289d7d15aa9db251bfeabc8e49a19de9e664819b6e878ed76");

    /// Makes a network 3 -> 8, layer norm, -> 2.
    fn normed() -> Graph {
        let mut graph = Graph::new(3);
        graph.matrices = testing::layers(&[3, 8, 2]).matrices;
        graph.add(Linear { matrix: 0, bias: vec![0.1; 8] }, &[0]).expect("it fits");
        graph.add(LayerNorm { weight: vec![1.2; 8], bias: vec![0.1; 8], eps: 1e-5 }, &[1]).expect("it fits");
        graph.add(Linear { matrix: 1, bias: vec![0.1; 2] }, &[2]).expect("it fits");
        graph
    }

    #[test]
    fn a_change_of_images_raises_the_revision() {
        let mut all = Sha256::new();
        type Record = fn(&Graph, usize, usize) -> Dataset;
        let graphs: [(&str, Graph, Record); _] = [
            ("mlp", testing::mlp(), testing::dataset),
            ("normed", normed(), testing::dataset),
            ("residual", testing::residual(4, true), testing::dataset),
            ("lstm", testing::lstm(), testing::dataset),
            ("branches", testing::branches([4, 3]), testing::dataset),
            ("transformer", testing::transformer(0), testing::dataset),
            ("driven mlp", testing::mlp(), testing::driven),
            ("driven lstm", testing::lstm(), testing::driven),
        ];
        for (name, graph, record) in graphs {
            let [calib, heldout] = [16, 4].map(|episodes| Some(record(&graph, episodes, 20)));
            let (policy, recordings) = (Policy::of(name, graph), Recordings { calib, heldout });
            let bytes = if name == "transformer" { 12288 } else { 4096 };
            for method in [Method::Rtn, Method::Gptq, Method::Distill] {
                for budget in [Budget::Width(Width::W3), Budget::BitsPerWeight(60.0), Budget::ImageBytes(bytes)] {
                    let options = Options { steps: Some(20), ..Options::new(method.clone(), budget) };
                    let made = quantize(&policy, &recordings, &options, ()).expect("an image");
                    all.update(&made.image);
                }
            }
        }
        let found = hex(&all.finalize());
        assert!(
            DIGEST == (REVISION, &found),
            "the images have changed. Raise REVISION, here and in DIGEST, and write {found} into DIGEST; if only REVISION was \
             raised, do the latter"
        );
    }
}
