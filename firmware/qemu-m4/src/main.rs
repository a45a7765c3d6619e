//! A controller at work on a Cortex-M4F: the control interrupt runs the policy, an interrupt of lower priority plays the
//! converter, and the main program sleeps.
//!
//! State belongs to one interrupt each (the handlers' own variables); what passes between them are words that are read
//! and written in one instruction. There is no lock, no heap, and nothing of an operating system.
#![no_std]
#![no_main]

mod converter;
mod run;

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{Peripherals, SCB};
use cortex_m_rt::{entry, exception};
use cortex_m_semihosting::{debug, hprintln};

use run::{Outcome, Run, PERIODS};

policy_macro::include_policy!("policy/policy.toml", target = "cortex-m4f");
use buck12::{Controller, Measurement};

/// Ticks of the processor's clock between two control interrupts: 100 us at the 25 MHz of the board.
const TICKS: u32 = 2500;
/// A settled voltage is as near as this to 100 V, mV.
const TOLERANCE: i32 = 100;

/// Registers of an ADC: samples of `v_out`, `i_l`, `i_out` as bits, and how often they were taken.
static SAMPLES: [AtomicU32; 3] = [const { AtomicU32::new(0) }; 3];
static SAMPLED: AtomicU32 = AtomicU32::new(0);
/// Registers of a PWM unit: duty and status as bits, and how often they were set.
static DUTY: AtomicU32 = AtomicU32::new(0);
static STATUS: AtomicU32 = AtomicU32::new(0);
static COMMANDED: AtomicU32 = AtomicU32::new(0);
/// Control interrupts that found no new sample: the converter's interrupt had not ended.
static LATE: AtomicU32 = AtomicU32::new(0);
/// The outcome, and whether the run has ended.
static OUTCOME: [AtomicU32; 5] = [const { AtomicU32::new(0) }; 5];
static ENDED: AtomicBool = AtomicBool::new(false);

/// The control interrupt. On a converter it is the timer's or the ADC's.
#[exception]
fn SysTick() {
    static mut CONTROLLER: Controller = Controller::new();
    if SAMPLED.load(Relaxed) == COMMANDED.load(Relaxed) {
        LATE.fetch_add(1, Relaxed);
        return;
    }
    let [v_out, i_l, i_out] = [0, 1, 2].map(|index: usize| f32::from_bits(SAMPLES[index].load(Relaxed)));
    let command = CONTROLLER.step(&Measurement { v_out, i_l, i_out });
    DUTY.store(command.duty.to_bits(), Relaxed);
    STATUS.store(command.status, Relaxed);
    COMMANDED.fetch_add(1, Relaxed);
    SCB::set_pendsv();
}

/// The converter: one period under the new duty, then new samples.
#[exception]
fn PendSV() {
    static mut RUN: Run = Run::new();
    if COMMANDED.load(Relaxed) > 0 {
        RUN.advance(f32::from_bits(DUTY.load(Relaxed)), STATUS.load(Relaxed));
    }
    if RUN.period() == PERIODS {
        publish(RUN.outcome());
        return;
    }
    for (register, sample) in SAMPLES.iter().zip(RUN.samples()) {
        register.store(sample.to_bits(), Relaxed);
    }
    SAMPLED.fetch_add(1, Relaxed);
}

fn publish(outcome: Outcome) {
    let words = [
        outcome.checksum as u32,
        (outcome.checksum >> 32) as u32,
        outcome.extremes[0] as u32,
        outcome.extremes[1] as u32,
        outcome.settled_error as u32,
    ];
    for (word, value) in OUTCOME.iter().zip(words) {
        word.store(value, Relaxed);
    }
    ENDED.store(true, Relaxed);
}

#[entry]
fn main() -> ! {
    let trustworthy = Controller::self_test().is_ok() && Controller::integrity();
    if let (true, Some(peripherals)) = (trustworthy, Peripherals::take()) {
        start(peripherals);
    } else {
        hprintln!("self-test or integrity failed");
        debug::exit(debug::EXIT_FAILURE);
    }
    while !ENDED.load(Relaxed) {
        cortex_m::asm::wfi();
    }
    // one processor: what an interrupt has stored before it set `ENDED` is seen after it
    let [low, high, lowest, highest, error] = OUTCOME.each_ref().map(|word| word.load(Relaxed));
    let passed = (error as i32) < TOLERANCE;
    hprintln!("{} periods of 100 us, 200 W, 800 W, 200 W", PERIODS);
    hprintln!(
        "v_out {} to {} mV, within {} mV once settled",
        lowest as i32,
        highest as i32,
        error as i32
    );
    hprintln!("late control interrupts: {}", LATE.load(Relaxed));
    hprintln!("checksum {:08x}{:08x}", high, low);
    debug::exit(if passed {
        debug::EXIT_SUCCESS
    } else {
        debug::EXIT_FAILURE
    });
    loop {}
}

/// First samples, priorities, the timer.
fn start(mut peripherals: Peripherals) {
    // SAFETY: no critical section is built on priorities
    unsafe {
        peripherals.SCB.set_priority(SystemHandler::PendSV, 0xff);
        peripherals.SCB.set_priority(SystemHandler::SysTick, 0x00);
    }
    SCB::set_pendsv();
    while SAMPLED.load(Relaxed) == 0 {}
    let timer = &mut peripherals.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICKS - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
