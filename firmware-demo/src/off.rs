//! A tick without a controller.

use actq_boards::seams::Stage;

use crate::application::Control;

/// Keeps the power stage off: what stands here until a controller does.
#[derive(Debug)]
pub struct Off;

impl<S: Stage> Control<S> for Off {
    fn on_tick(&mut self, _: Option<&[f32]>, stage: &mut S) {
        stage.disable();
    }
}
