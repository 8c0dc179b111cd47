//! The smallest and the fastest images that keep f32's success.

use std::fmt::Write as _;

use anyhow::Result;

use super::cell::{Cell, Made};
use super::limits::Limit;
use super::plan::Contender;

/// Writes the fewest bytes and the fewest milliseconds at which each method keeps f32's success: that of the image is
/// not below the interval of f32's. Writes nothing if f32 was not driven.
pub(super) fn write(
    text: &mut String,
    methods: &[Contender],
    f32_cell: Option<&Cell>,
    cells: &[(Contender, Limit, Option<&Cell>)],
) -> Result<()> {
    let Some([low, _]) = f32_cell.and_then(|cell| cell.outcome()?.interval()) else { return Ok(()) };
    // In whole percent, as the table above gives the interval.
    let low = (100.0 * low).round() / 100.0;
    writeln!(
        text,
        "The fewest bytes and milliseconds of an image above with at least {:.0}% success, where f32's interval begins:\n",
        100.0 * low
    )?;
    writeln!(text, "| method | bytes | ms |\n|---|---:|---:|")?;
    for &method in methods {
        let keeps =
            |cell: &Cell| cell.outcome().and_then(|outcome| outcome.success()).is_some_and(|share| share >= low);
        let of_method = cells.iter().filter(|(of, ..)| *of == method).filter_map(|(.., cell)| *cell);
        let keeping: Vec<&Made> = of_method.filter(|cell| keeps(cell)).filter_map(|cell| cell.made.as_ref()).collect();
        let bytes = keeping.iter().map(|made| made.bytes).min();
        let milliseconds = keeping.iter().filter_map(|made| made.fewest_milliseconds()).min_by(f64::total_cmp);
        writeln!(
            text,
            "| {} | {} | {} |",
            method.title(),
            bytes.map_or_else(|| "-".to_owned(), |bytes| bytes.to_string()),
            milliseconds.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.3}"))
        )?;
    }
    writeln!(text)?;
    Ok(())
}
