//! Factors, offsets and linear layers.

use std::sync::Arc;

use crate::values::compare::uniform;
use crate::values::expr::{Expr, Exprs, Id, Matrix, Run};

impl Exprs {
    /// Returns `a x + b`, with the same a and b for all elements.
    pub(crate) fn scaled(&mut self, x: Id, a: f64, b: f64) -> Id {
        let n = self.len_of(x);
        self.affine(x, vec![a; n], vec![b; n])
    }

    /// Returns `a x + b`.
    pub(crate) fn affine(&mut self, x: Id, a: Vec<f64>, b: Vec<f64>) -> Id {
        let len = self.len_of(x);
        let (ones, zeros) = (uniform(&a) == Some(1.0), uniform(&b) == Some(0.0));
        if ones && zeros {
            return x;
        }
        let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<f64>>();
        let sum = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x + y).collect::<Vec<f64>>();
        match self.get(x) {
            Expr::Affine(of, a0, b0) => {
                let (of, a0, b0) = (*of, product(a0, &a), sum(&product(b0, &a), &b));
                self.affine(of, a0, b0)
            }
            Expr::Linear(of, w, bias) if ones => {
                let linear = Expr::Linear(*of, Arc::clone(w), sum(bias, &b));
                self.put(linear, len)
            }
            Expr::LayerNorm(of, weight, bias, eps) => {
                let norm = Expr::LayerNorm(*of, product(weight, &a), sum(&product(bias, &a), &b), *eps);
                self.put(norm, len)
            }
            Expr::RmsNorm(of, weight, eps) if zeros => {
                let norm = Expr::RmsNorm(*of, product(weight, &a), *eps);
                self.put(norm, len)
            }
            // Rows that are outputs of layers or norms.
            Expr::Pick(runs) if runs.len() > 1 && runs.iter().all(|run| self.absorbs(run, ones, zeros)) => {
                let (runs, mut at, mut moved) = (runs.clone(), 0, Vec::new());
                for run in runs {
                    let (a, b) = (a[at..at + run.len].to_vec(), b[at..at + run.len].to_vec());
                    moved.push(Run { of: self.affine(run.of, a, b), ..run });
                    at += run.len;
                }
                self.put(Expr::Pick(moved), len)
            }
            Expr::Spread(one) if uniform(&a).is_some() && uniform(&b).is_some() => {
                let one = *one;
                let one = self.affine(one, a[..1].to_vec(), b[..1].to_vec());
                self.put(Expr::Spread(one), len)
            }
            _ => self.put(Expr::Affine(x, a, b), len),
        }
    }

    /// Returns `true` if a run is a whole layer or norm that can absorb the factors and offsets. `ones` means no
    /// factors, `zeros` no offsets.
    fn absorbs(&self, run: &Run, ones: bool, zeros: bool) -> bool {
        let of_kind = match self.get(run.of) {
            Expr::Linear(..) => ones,
            Expr::LayerNorm(..) => true,
            Expr::RmsNorm(..) => zeros,
            _ => false,
        };
        of_kind && run.from == 0 && run.len == self.len_of(run.of)
    }

    /// Returns `W x + b`.
    pub(crate) fn linear(&mut self, x: Id, w: Arc<Matrix>, b: Vec<f64>) -> Id {
        let rows = w.rows;
        self.put(Expr::Linear(x, w, b), rows)
    }
}
