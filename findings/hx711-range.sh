#!/bin/sh
# hx711 0.7.0 (crates.io, amplifier of a load cell, as in a gripper): MIN_VALUE, "Minimum ADC value", is +8388608 and not -8388608: it lies above MAX_VALUE, 8388607. A guard that looks for a saturated cell by value == MIN_VALUE never finds the lower
# end, one by value <= MIN_VALUE takes each reading for saturated, and a span of MAX_VALUE - MIN_VALUE is -1, so that a scale of force by it has the wrong sign and 16 million times the size. The driver itself reads the lower end
# rightly. There is no error.
# Seen on 2026-11-30:  MAX_VALUE 8388607, MIN_VALUE 8388608   a cell at its lower end reads -8388608   MAX_VALUE - MIN_VALUE: -1 (16777215)
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "range"
version = "0.0.0"
edition = "2021"

[dependencies]
embedded-hal = "=1.0.0"
hx711 = "=0.7.0"
nb = "=1.1.0"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::{delay::DelayNs, digital};
use std::{cell::RefCell, convert::Infallible, rc::Rc};

/// The bits that the sensor still has for the current conversion, and its clock.
#[derive(Default)]
struct Chip {
    code: u32,
    clocks: usize,
}

#[derive(Clone, Default)]
struct Pin(Rc<RefCell<Chip>>);

impl digital::ErrorType for Pin {
    type Error = Infallible;
}

impl digital::OutputPin for Pin {
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().clocks += 1;
        Ok(())
    }
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl digital::InputPin for Pin {
    /// Low for a conversion that is ready, then the bits from the highest on.
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let chip = self.0.borrow();
        Ok((1..=24).contains(&chip.clocks) && chip.code >> (24 - chip.clocks) & 1 == 1)
    }
    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

struct None;

impl DelayNs for None {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() {
    let pin = Pin::default();
    pin.0.borrow_mut().clocks = 0;
    let mut read = |code: u32| {
        *pin.0.borrow_mut() = Chip::default();
        let mut cell = hx711::Hx711::new(None, Ready(pin.clone()), pin.clone()).unwrap();
        *pin.0.borrow_mut() = Chip { code, clocks: 0 };
        cell.retrieve().unwrap()
    };
    let (lower, upper, small) = (read(0x800000), read(0x7FFFFF), read(0x000010));
    println!("SEEN MAX_VALUE {}, MIN_VALUE {}; lower end {lower}, upper end {upper}, small {small}; MAX_VALUE - MIN_VALUE {}", hx711::MAX_VALUE, hx711::MIN_VALUE, hx711::MAX_VALUE - hx711::MIN_VALUE);
    assert_eq!((lower, upper, small), (-8_388_608, 8_388_607, 16));
    assert_eq!((hx711::MAX_VALUE, hx711::MIN_VALUE), (8_388_607, 8_388_608));
    assert!(upper < hx711::MIN_VALUE && lower != hx711::MIN_VALUE);
}

/// The same pin as an input.
struct Ready(Pin);

impl digital::ErrorType for Ready {
    type Error = Infallible;
}

impl digital::InputPin for Ready {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        self.0.is_high()
    }
    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.0.is_low()
    }
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
