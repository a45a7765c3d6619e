//! Stands in for a microcontroller: no std, own entry point and panic handler, exit code 0 if all is well.
#![no_std]
#![no_main]

mod control;

use control::{interrupt, is_trustworthy, Controller, Measurement, PERIOD_TICKS};

// memcpy and the start-up code; a microcontroller brings its own
#[link(name = "c")]
extern "C" {}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

// the core library of a hosted system is built for unwinding and asks for this; unoptimised code does not lose the ask
#[cfg(debug_assertions)]
#[no_mangle]
extern "C" fn rust_eh_personality() {}

#[no_mangle]
pub extern "C" fn main() -> i32 {
    if !is_trustworthy() {
        return 1;
    }
    let mut controller = Controller::new();
    let mut v_out = 90.0_f32;
    for _ in 0..2000 {
        let ticks = interrupt(
            &mut controller,
            &Measurement {
                v_out,
                i_l: 5.0,
                i_out: 5.0,
            },
        );
        // a plant in one line: towards the mean voltage of the duty
        v_out += 0.02 * (200.0 * f32::from(ticks) / f32::from(PERIOD_TICKS) - v_out);
    }
    let settled = (98.0..102.0).contains(&v_out);
    // the switch opens when the sensors die
    let blind = Measurement {
        v_out: f32::NAN,
        i_l: f32::NAN,
        i_out: f32::NAN,
    };
    let mut last = 1;
    for _ in 0..8 {
        last = interrupt(&mut controller, &blind);
    }
    i32::from(!(settled && last == 0)) * 2
}
