//! Elementwise operators: functions, sums and products, comparisons.

use actq::error::{Context as _, Result};

use crate::nodes::arithmetic;
use crate::nodes::call::Call;
use crate::nodes::conditions;
use crate::nodes::functions;
use crate::values::elements::each;
use crate::values::expr::Exprs;
use crate::values::tensor::Tensor;

/// Returns the output, if the node is such an operator.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs, most: usize) -> Result<Option<Tensor>> {
    match call.op() {
        "Add" | "Sub" | "Mul" | "Div" | "Pow" | "PRelu" => {
            let (x, y) = (call.input(0)?, call.input(1)?);
            arithmetic::two(call.op(), exprs, x, y, most).map(Some)
        }
        "Sum" | "Max" | "Min" | "Mean" => {
            let op = if matches!(call.op(), "Sum" | "Mean") { "Add" } else { call.op() };
            let given: Vec<&Tensor> = call.inputs.iter().copied().flatten().collect();
            let (first, rest) = given.split_first().context("has no input")?;
            let mut all = Tensor::clone(first);
            for next in rest {
                all = arithmetic::two(op, exprs, &all, next, most)?;
            }
            if call.op() == "Mean" {
                all = each(exprs, &all, &|exprs, x| exprs.scaled(x, 1.0 / given.len() as f64, 0.0))?;
            }
            Ok(Some(all))
        }
        "Greater" | "GreaterOrEqual" | "Less" | "LessOrEqual" => conditions::above(call, exprs),
        "IsNaN" | "IsInf" => conditions::not_finite(call, exprs).map(Some),
        "Equal" => conditions::itself(call, exprs),
        "And" | "Or" => conditions::both(call, most),
        "Not" => conditions::not(call, exprs),
        "Where" => conditions::options(call, exprs, most).map(Some),
        _ => functions::one(call, exprs),
    }
}
