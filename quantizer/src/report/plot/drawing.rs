//! Parts of SVG pictures.

use std::fmt::Write as _;

/// Okabe and Ito's colour-blind safe palette, ordered by contrast on white.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// Creates an SVG document of this size with a white background, and draws on it by `draw`.
pub(crate) fn document(
    width: f64,
    height: f64,
    draw: impl FnOnce(&mut String) -> std::fmt::Result,
) -> Result<String, std::fmt::Error> {
    let mut svg = String::new();
    writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="Helvetica, Arial, 'Liberation Sans', sans-serif" font-size="13" fill="#333">"##
    )?;
    writeln!(svg, r##"<rect width="100%" height="100%" fill="#fff"/>"##)?;
    draw(&mut svg)?;
    writeln!(svg, "</svg>")?;
    Ok(svg)
}

/// Appends escaped text.
pub(crate) fn text(svg: &mut String, x: f64, y: f64, attributes: &str, content: &str) -> std::fmt::Result {
    let content = content.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    writeln!(svg, r#"<text x="{x:.1}" y="{y:.1}" {attributes}>{content}</text>"#)
}

/// Formats a power of ten as a label.
pub(crate) fn decade_label(decade: i32) -> String {
    match decade {
        -3..=3 => format!("{}", 10f64.powi(decade)),
        _ => format!("1e{decade}"),
    }
}

/// Returns the colour of a series.
pub(super) fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

/// Returns a ring.
pub(super) fn ring(x: f64, y: f64, radius: f64) -> String {
    format!(r##"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="none" stroke="#333" stroke-width="1.5"/>"##)
}

/// Returns a dashed grey path.
pub(super) fn dashes(path: &str) -> String {
    format!(r##"<path d="{path}" fill="none" stroke="#777" stroke-width="1.5" stroke-dasharray="5 4"/>"##)
}

/// Returns a marker with the series' own shape and colour.
pub(super) fn marker(index: usize, x: f64, y: f64) -> String {
    let style = format!(r##"fill="{}" stroke="#fff" stroke-width="1.2""##, colour(index));
    let polygon = |corners: &[(f64, f64)]| {
        let points: Vec<String> = corners.iter().map(|(dx, dy)| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
        format!(r#"<polygon points="{}" {style}/>"#, points.join(" "))
    };
    match index % 4 {
        0 => format!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="5" {style}/>"#),
        1 => polygon(&[(-4.6, -4.6), (4.6, -4.6), (4.6, 4.6), (-4.6, 4.6)]),
        2 => polygon(&[(0.0, -6.2), (5.8, 4.4), (-5.8, 4.4)]),
        _ => polygon(&[(0.0, -6.2), (6.2, 0.0), (0.0, 6.2), (-6.2, 0.0)]),
    }
}
