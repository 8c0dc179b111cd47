//! The revision of the images that this library makes.

/// Number of the methods, of all that the pipeline does with them, and of the image's form. It is raised whenever the
/// same policy, recordings and options give other bytes than before: results of another revision must not be taken for
/// those of this one.
pub const REVISION: u32 = 4;

#[cfg(test)]
mod tests {
    use actq_kernels::Width;
    use sha2::{Digest as _, Sha256};

    use super::REVISION;
    use crate::budget::Budget;
    use crate::data::Recordings;
    use crate::measure::size::hex;
    use crate::methods::{Method, Options};
    use crate::pipeline::quantize;
    use crate::policy::Policy;
    use crate::testing;

    /// The SHA-256 of all images below, at this revision.
    const DIGEST: (u32, &str) = (4, "07bd1df5ec4a250eb21b3c998642be72302f67c4c518ccaf69c34153ab636e20");

    #[test]
    fn a_change_of_images_raises_the_revision() {
        let mut all = Sha256::new();
        for (name, graph) in [("mlp", testing::mlp()), ("lstm", testing::lstm())] {
            let [calib, heldout] = [16, 4].map(|episodes| Some(testing::dataset(&graph, episodes, 20)));
            let (policy, recordings) = (Policy::of(name, graph), Recordings { calib, heldout });
            for method in [Method::Rtn, Method::Gptq, Method::Distill] {
                for budget in [Budget::Width(Width::W3), Budget::BitsPerWeight(60.0), Budget::ImageBytes(4096)] {
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
