//! The adapter at a driver that only remembers.

extern crate std;

use std::vec::Vec;

use embedded_hal::pwm::{ErrorKind, ErrorType, SetDutyCycle};

use super::buck12::{Command, Controller, Measurement, status};
use super::{Applied, PwmActuator, ticks};

/// A timer of 168 MHz at 20 kHz, up: 8,400 ticks.
#[derive(Debug, Default)]
struct Mock {
    set: Vec<u16>,
    fractions: Vec<(u16, u16)>,
    broken: bool,
}

impl ErrorType for Mock {
    type Error = ErrorKind;
}

impl SetDutyCycle for Mock {
    fn max_duty_cycle(&self) -> u16 {
        8400
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), ErrorKind> {
        if self.broken {
            return Err(ErrorKind::Other);
        }
        self.set.push(duty);
        Ok(())
    }

    fn set_duty_cycle_fraction(&mut self, num: u16, denom: u16) -> Result<(), ErrorKind> {
        self.fractions.push((num, denom));
        Ok(())
    }
}

fn actuator() -> PwmActuator<Mock> {
    PwmActuator::new(Mock::default(), 0.40..=0.60, 0.0).unwrap()
}

fn command(duty: f32, status: u32) -> Command {
    Command {
        duty,
        duty_sim: duty,
        action_index: 0,
        status,
    }
}

#[test]
fn a_duty_becomes_the_nearest_tick() {
    assert_eq!(ticks(0.5, 8400), 4200);
    // 0.44 * 8400 = 3696 exactly in decimals; f32 lies a hair off
    assert_eq!(ticks(0.44, 8400), 3696);
    assert_eq!(ticks(4199.5 / 8400.0, 8400), 4200);
    assert_eq!(ticks(4199.49 / 8400.0, 8400), 4199);
    assert_eq!((ticks(0.0, 8400), ticks(1.0, 8400)), (0, 8400));
    assert_eq!(
        (ticks(-0.1, 8400), ticks(1.1, 8400), ticks(f32::NAN, 8400)),
        (0, 8400, 0)
    );
    assert_eq!((ticks(1.0, u16::MAX), ticks(2.0, u16::MAX)), (u16::MAX, u16::MAX));
}

#[test]
fn the_rounding_is_within_half_a_tick_everywhere() {
    for max in [99_u16, 8400, 17_000, u16::MAX] {
        for index in 0..=1000_u16 {
            let duty = f32::from(index) / 1000.0;
            let exact = f64::from(duty) * f64::from(max);
            let error = f64::from(ticks(duty, max)) - exact;
            assert!(error.abs() <= 0.51, "{duty} of {max}: {error}");
        }
    }
}

#[test]
fn the_channel_starts_safe_and_follows_commands() {
    let mut actuator = actuator();
    assert_eq!(actuator.apply(&command(0.5, 0)), Ok(Applied::Commanded));
    assert_eq!(
        actuator.apply(&command(0.40, status::LIMITED | status::HELD)),
        Ok(Applied::Commanded)
    );
    assert_eq!(actuator.pwm.set, [0, 4200, 3360]);
    assert_eq!(actuator.apply_fraction(&command(0.5, 0)), Ok(Applied::Commanded));
    assert_eq!(actuator.pwm.fractions, [(32768, 65535)]);
}

#[test]
fn a_fault_sets_the_safe_duty_and_the_next_good_command_ends_it() {
    let mut actuator = PwmActuator::new(Mock::default(), 0.40..=0.60, 0.25).unwrap();
    for bad in [
        command(0.5, status::FALLBACK),
        command(0.39, 0),
        command(0.61, 0),
        command(f32::NAN, 0),
    ] {
        assert_eq!(actuator.apply(&bad), Ok(Applied::Safe));
        assert_eq!(actuator.apply_fraction(&bad), Ok(Applied::Safe));
    }
    assert_eq!(actuator.apply(&command(0.5, 0)), Ok(Applied::Commanded));
    assert_eq!(actuator.pwm.set, [&[2100; 9][..], &[4200]].concat());
    assert!(actuator.pwm.fractions.is_empty());
}

#[test]
fn the_bits_that_count_as_faults_can_be_chosen() {
    let mut strict = actuator().with_faults(status::FALLBACK | status::HELD);
    assert_eq!(strict.apply(&command(0.5, status::HELD)), Ok(Applied::Safe));
    assert_eq!(
        strict.apply(&command(0.5, status::SLEW_LIMITED)),
        Ok(Applied::Commanded)
    );
}

#[test]
fn the_error_of_a_driver_comes_back() {
    let mut actuator = actuator();
    actuator.pwm.broken = true;
    assert_eq!(actuator.apply(&command(0.5, 0)), Err(ErrorKind::Other));
    assert_eq!(actuator.make_safe(), Err(ErrorKind::Other));
}

/// The example policy holds three bad samples and then falls back to duty 0.
#[test]
fn dead_sensors_open_the_switch() {
    let (mut controller, mut actuator) = (Controller::new(), actuator());
    let good = Measurement {
        v_out: 100.0,
        i_l: 5.0,
        i_out: 5.0,
    };
    let dead = Measurement {
        v_out: f32::NAN,
        ..good
    };
    let samples = [good, good, dead, dead, dead, dead, good];
    let applied = samples.map(|sample| actuator.apply(&controller.step(&sample)).unwrap());
    let safe: Vec<bool> = applied.iter().map(|applied| *applied == Applied::Safe).collect();
    assert_eq!(safe, [false, false, false, false, false, true, false]);
    assert_eq!(actuator.pwm.set[6], 0);
}
