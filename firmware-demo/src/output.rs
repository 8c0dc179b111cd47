//! The last action, on its way from the loop to the tick.

/// Values of an action that the tick takes at most.
pub const MAX_ACTION: usize = 64;

/// The last action, on its way from the loop to the tick.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    values: [f32; MAX_ACTION],
    len: usize,
}

impl Output {
    /// No action yet.
    pub const NONE: Self = Self { values: [0.0; MAX_ACTION], len: 0 };

    /// Takes an action. One that is longer than [`MAX_ACTION`] counts as none.
    pub fn set(&mut self, action: &[f32]) {
        self.len = 0;
        if let Some(values) = self.values.get_mut(..action.len()) {
            values.copy_from_slice(action);
            self.len = action.len();
        }
    }

    /// The last action.
    pub fn get(&self) -> Option<&[f32]> {
        self.values.get(..self.len).filter(|action| !action.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_action_that_is_too_long_is_none() {
        let mut output = Output::NONE;
        assert_eq!(output.get(), None);
        output.set(&[1.0, 2.0]);
        assert_eq!(output.get(), Some(&[1.0, 2.0][..]));
        output.set(&[0.0; MAX_ACTION + 1]);
        assert_eq!(output.get(), None);
    }
}
