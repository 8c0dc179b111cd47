//! Integer inputs, such as the time step of a denoiser. They are observed in float32 if the file casts them before it
//! computes with them.

use actq::error::Result;

use crate::nodes::call::Call;
use crate::values::expr::{Expr, Exprs};
use crate::values::tensor::{Data, Element, Tensor};

/// Returns the output of a cast of such an input.
pub(crate) fn cast(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let to = match call.op() {
        "Cast" => call.int("to"),
        "CastLike" if call.input(1)?.integers().is_none() && !holds_integers(call.input(1)?, exprs) => Some(1),
        "CastLike" => Some(7),
        _ => return Ok(None),
    };
    let x = call.input(0)?;
    if !holds_integers(x, exprs) {
        return Ok(None);
    }
    Ok(match to {
        Some(1 | 11) => {
            let mut elements = x.elements();
            for element in &mut elements {
                if let Element::Of(id, i) = *element
                    && let Expr::Integers(input) = *exprs.get(id)
                {
                    *element = Element::Of(exprs.put(Expr::Input(input), exprs.len_of(id)), i);
                }
            }
            Some(Tensor::new(x.shape.clone(), Data::Open(elements)))
        }
        // Casts between int32 and int64 have no effect on observed integers.
        Some(6 | 7) => Some(x.clone()),
        _ => None,
    })
}

fn holds_integers(x: &Tensor, exprs: &Exprs) -> bool {
    let Data::Open(elements) = &x.data else { return false };
    elements.iter().any(|e| matches!(e, Element::Of(id, _) if matches!(exprs.get(*id), Expr::Integers(_))))
}
