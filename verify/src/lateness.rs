//! When the duty of a step acts on the board, beside when it did in the training.

use policy::Observer;

use crate::budget::{Budget, Fit, HALF, Slot, percent};

/// What is said of it: one line, `None` where a step fits into half of the period and nothing contradicts the training.
#[must_use]
pub fn note(budget: &Budget, slot: Slot, observers: &[Observer]) -> Option<String> {
    let all_count_on_it = !observers.is_empty() && observers.iter().all(|observer| observer.compute_delay == 1);
    let most = budget.share.1;
    let takes = format!("  note: a step takes up to {} % of the period", percent(most));
    match slot {
        // what fits behind the sample acts from the next start on, as the training had it
        Slot::Behind(_) => None,
        Slot::Later => observers.iter().find(|observer| observer.compute_delay == 0).map(|observer| {
            format!(
                "  warning: in the plant file the duty acts one period later (pwm.duty_delay), and observer `{}` of the contract does not \
                 know it: compute_delay = 1, and a policy that was trained so",
                observer.name
            )
        }),
        Slot::Unknown | Slot::AtOnce if budget.fit == Fit::Missed || most <= HALF => None,
        Slot::Unknown | Slot::AtOnce if all_count_on_it => Some(format!(
            "{takes}. The contract counts on a duty that acts one period later (compute_delay = 1): let the timer take it over at the start \
             of the next period, never earlier"
        )),
        Slot::Unknown | Slot::AtOnce => Some(untrained(takes, most, slot, !observers.is_empty())),
    }
}

/// The note on a duty that can be later than the training had it.
fn untrained(takes: String, most: f64, slot: Slot, has_observers: bool) -> String {
    let and_there = match has_observers {
        true => ", and compute_delay = 1 in the contract",
        false => "",
    };
    if slot == Slot::AtOnce {
        return format!(
            "{takes}. In the plant file its duty acts at the instant of the sample, which no timer does: train again with \
             pwm.duty_delay = 1{and_there}, and the step has the whole period"
        );
    }
    // what is left in whole percent, or there is no instant to be named
    match most < 0.99 {
        true => format!(
            "{takes}. Sampled within the first {:.0} % of it, the duty acts from the next start on; later, it can miss that start and act \
             one period later, and the training has to have had that: pwm.duty_delay = 1 in the plant file{and_there}. `--plant` with the \
             training's plant file says which it is",
            100.0 * (1.0 - most)
        ),
        false => format!(
            "{takes}, and one that takes more than 100 % is late in every period, which no training mends. One that takes less has a duty \
             that acts one period later, and the training has to have had that: pwm.duty_delay = 1 in the plant file{and_there}"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 us at 100 MHz are 10,000 cycles.
    fn said(most: f64, slot: Slot) -> Option<String> {
        let budget = Budget {
            clock_hz: 1e8,
            period_cycles: 1e4,
            part: slot.part(),
            share: (most / 2.0, most),
            fit: match most {
                most if most <= 1.0 => Fit::Met,
                most if most <= 2.0 => Fit::Doubtful,
                _ => Fit::Missed,
            },
        };
        note(&budget, slot, &[])
    }

    #[test]
    fn a_duty_that_can_miss_its_start_is_said() {
        assert_eq!(said(0.49, Slot::Unknown), None);
        assert!(
            said(0.62, Slot::Unknown)
                .unwrap()
                .contains("within the first 38 % of it")
        );
        assert!(
            said(1.0001, Slot::Unknown)
                .unwrap()
                .contains("late in every period, which no training")
        );
        // what does not fit at all is another matter
        assert_eq!(said(2.5, Slot::Unknown), None);
    }

    #[test]
    fn what_the_plant_file_says_is_not_guessed_at() {
        for most in [0.3, 0.9, 1.4] {
            assert_eq!(said(most, Slot::Behind(0.5)), None);
            assert_eq!(said(most, Slot::Later), None);
        }
        assert_eq!(said(0.3, Slot::AtOnce), None);
        assert!(said(0.9, Slot::AtOnce).unwrap().contains("which no timer does"));
    }
}
