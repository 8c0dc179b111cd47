//! Limits in text form.

use actq_controller::Limits;
use actq_controller::limits::LimitsError;

#[test]
fn limits_are_parsed_displayed_and_refused() {
    let limits = |low, high, rate| Ok(Limits { low, high, rate });
    let cases = [
        ("-1:1", limits(-1.0, 1.0, None)),
        ("0:0", limits(0.0, 0.0, None)),
        ("-0.1:1e3:20", limits(-0.1, 1000.0, Some(20.0))),
        (" -1 : 1 : 2 ", limits(-1.0, 1.0, Some(2.0))),
        ("", Err(LimitsError::Parts)),
        ("1", Err(LimitsError::Parts)),
        ("-1:1:2:3", Err(LimitsError::Parts)),
        (":", Err(LimitsError::Number)),
        ("-1:one", Err(LimitsError::Number)),
        ("-inf:1", Err(LimitsError::Number)),
        ("-1:NaN", Err(LimitsError::Number)),
        ("-1:1:inf", Err(LimitsError::Number)),
        ("1:-1", Err(LimitsError::Reversed)),
        ("-1:1:0", Err(LimitsError::Rate)),
        ("-1:1:-2", Err(LimitsError::Rate)),
    ];
    for (text, expected) in cases {
        let found: Result<Limits, _> = text.parse();
        assert_eq!(found, expected, "{text:?}");
        if let Ok(limits) = found {
            assert_eq!(limits.to_string().parse(), Ok(limits));
        }
    }
}

#[test]
fn the_stricter_of_two_limits_holds() {
    let of = |text: &str| text.parse::<Limits>().expect("limits");
    for (image, built, axes) in [
        (None, &[][..], [None; 2]),
        (None, &["-1:1:3"], [Some("-1:1:3"); 2]),
        (None, &["-1:1", "-2:2"], [Some("-1:1"), Some("-2:2")]),
        (Some([-1.0, 0.5]), &[], [Some("-1:0.5"); 2]),
        (Some([-1.0, 0.5]), &["-2:0.25:3"], [Some("-1:0.25:3"); 2]),
        (Some([-1.0, 0.5]), &["-0.5:2", "0.6:2"], [Some("-0.5:0.5"), None]),
        (Some([-1.0, f32::INFINITY]), &["-2:2:3"], [Some("-1:2:3"); 2]),
        (Some([-1.0, f32::INFINITY]), &[], [None; 2]),
        (Some([f32::NEG_INFINITY, 0.5]), &[], [None; 2]),
    ] {
        let built: Vec<Limits> = built.iter().copied().map(of).collect();
        assert_eq!([0, 1].map(|i| Limits::of_axis(i, image, &built)), axes.map(|axis| axis.map(of)), "{built:?}");
    }
}
