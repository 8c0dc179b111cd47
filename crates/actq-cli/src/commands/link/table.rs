//! The table of `actq link watch`.

use actq_link::code::State;
use actq_link::report::{BUILT_IN, Breadcrumb, Counters, Status, Timing};
use comfy_table::{Table, presets};

/// Returns state, times and counters of a controller as a table. `here` holds the counters of the host's receiver.
pub(super) fn table(
    status: &Status,
    timing: &Timing,
    breadcrumb: &Breadcrumb,
    here: &Counters,
    reopened: u32,
) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    let mut row = |name: &str, text: String| {
        table.add_row([name.to_owned(), text]);
    };
    row("state", status.state.to_string());
    if let Some(fault) = status.fault {
        row("last fault", fault.to_string());
    }
    if status.state != State::Armed {
        row("arming", status.refusal.map_or("possible".to_owned(), |refusal| format!("refused: {refusal}")));
    }
    let slot = match status.slot {
        BUILT_IN => "built in".to_owned(),
        slot => format!("slot {slot}"),
    };
    row("image", format!("{:08x}, {slot}, {} values to {}", status.image, status.observation, status.axes));
    row("ticks", status.ticks.to_string());
    let milli = |nanos: u32| f64::from(nanos) / 1e6;
    row(
        "tick",
        format!(
            "{:.3} ms, worst {:.3} ms, jitter {:.3} ms, {} overruns",
            milli(timing.period),
            milli(timing.worst_tick),
            milli(timing.worst_jitter),
            timing.overruns
        ),
    );
    row("head", format!("worst {:.3} ms", f64::from(timing.worst_head) / 1e3));
    if timing.stack > 0 {
        row("stack", format!("at most {} bytes", timing.stack));
    }
    row("refused observations", status.refused.to_string());
    for (name, c) in [("controller received", &status.counters), ("host received", here)] {
        let text = format!(
            "{} good, {} damaged, {} malformed, {} repeated, {} lost",
            c.good, c.damaged, c.malformed, c.repeated, c.lost
        );
        row(name, text);
    }
    if reopened > 0 {
        row("port opened again", reopened.to_string());
    }
    row("reset by", status.reset.to_string());
    if let Some(crash) = breadcrumb.crash {
        row(
            "breadcrumb",
            format!(
                "{crash} at {:#010x}, detail {:#x}, tick {}, {} since power-on",
                breadcrumb.pc, breadcrumb.detail, breadcrumb.ticks, breadcrumb.count
            ),
        );
    }
    table
}
