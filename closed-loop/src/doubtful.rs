//! Numbers of a converter that the plant computes without a word, and that no working converter has: a frequency in kHz, an
//! inductance in microhenry, a load in kW, a resistance in milliohm.

use plant::{Load, Parameters, Topology};

/// Ripple of the inductor current over the largest current that the loads ask for.
// a converter is made for 0.2 to 0.5, and at a tenth of its load has ten times that
const RIPPLE: f64 = 20.0;
/// Share of the voltage that a load step may make at the capacitor's series resistance or a period of the load take off the capacitor,
/// and of the source's that the path of the current may take.
// electrolytics and long cables take a tenth or two
const SHARE: f64 = 0.5;
/// The filter's resonance over the PWM frequency: from half of it on the filter does not filter.
// converters are made for a tenth and less
const RESONANCE: f64 = 0.5;

/// What is doubtful of a converter that holds `v_ref` V at these loads, a sentence without a full stop each.
#[must_use]
pub fn doubts(converter: &Parameters, v_ref: f64, loads: &[Load]) -> Vec<String> {
    let currents = loads
        .iter()
        .map(|load| load.power / v_ref + load.current + load.conductance * v_ref);
    let (least, most) = currents.fold((f64::INFINITY, 0.0_f64), |(least, most), i| (least.min(i), most.max(i)));
    let own = &converter.converter;
    let duty = own.topology.duty(own.v_in, v_ref);
    let inductor = converter.holding_current(v_ref, most);
    let mut doubts = Vec::new();
    let on = match own.topology {
        Topology::Buck => own.v_in - v_ref,
        Topology::Boost | Topology::BuckBoost => own.v_in,
    };
    let ripple = on * duty / (own.inductance * own.f_sw);
    if most > 0.0 && inductor.is_finite() && ripple > RIPPLE * inductor {
        doubts.push(format!(
            "the inductor current swings by {ripple:.3} A in each period, where the loads ask for {inductor:.3} A: is f_sw in Hz, the \
             inductance in H, and are the loads in W"
        ));
    }
    // a boost feeds its capacitor for the rest of the period only, and resonates so much lower
    let give = own.topology.give(duty);
    let resonance = give / (std::f64::consts::TAU * (own.inductance * own.capacitance).sqrt());
    if resonance > RESONANCE * own.f_sw {
        doubts.push(format!(
            "inductance and capacitance resonate at {resonance:.0} Hz, the PWM runs at {} Hz: is f_sw in Hz, and are they in H and F",
            own.f_sw
        ));
    }
    let taken = most / (own.capacitance * own.f_sw);
    if taken > SHARE * v_ref {
        doubts.push(format!(
            "a load of {most:.3} A takes {taken:.3} V off the capacitor in each period, of {v_ref}: are the loads in W, the capacitance in \
             F and f_sw in Hz"
        ));
    }
    let esr = converter.capacitor.esr;
    let step = most - least;
    let jump = esr * step;
    if jump > SHARE * v_ref {
        doubts.push(format!(
            "a load step of {step:.3} A makes {jump:.3} V at capacitor.esr = {esr} ohm, beside {v_ref} V: is the resistance in ohm"
        ));
    }
    let path = converter.inductor.dcr + converter.switch.r_ds_on * duty;
    let drop = path * inductor;
    if drop.is_finite() && drop > SHARE * own.v_in {
        doubts.push(format!(
            "{inductor:.3} A through winding and switch, {path:.3} ohm, take {drop:.3} V of the source's {}: are the resistances in ohm",
            own.v_in
        ));
    }
    doubts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(change: impl FnOnce(&mut Parameters), watts: [f64; 2]) -> Vec<String> {
        let mut converter = Parameters::paper_model();
        change(&mut converter);
        doubts(&converter, 100.0, &watts.map(Load::power))
    }

    /// The paper's: 200 V to 100 V, 2 mH, 1.5 mF, 10 kHz, 2.5 A of ripple, 2 to 10 A.
    #[test]
    fn a_wrong_unit_is_doubted_by_the_number_it_is_in() {
        assert_eq!(said(|_| {}, [200.0, 1000.0]), Vec::<String>::new());
        let one = |change: fn(&mut Parameters), watts, word: &str| {
            let said = said(change, watts);
            assert!(said.iter().any(|doubt| doubt.contains(word)), "{word}: {said:?}");
        };
        one(|p| p.converter.f_sw = 10.0, [200.0, 1000.0], "f_sw in Hz");
        one(
            |p| p.converter.inductance = 2e-6,
            [200.0, 1000.0],
            "swings by 2500.000 A",
        );
        one(|p| p.converter.capacitance = 1.5e-9, [200.0, 1000.0], "resonate");
        one(|p| p.capacitor.esr = 10.0, [200.0, 1000.0], "capacitor.esr = 10 ohm");
        one(|p| p.inductor.dcr = 20.0, [200.0, 1000.0], "take 200.000 V");
        one(|_| {}, [0.2, 1.0], "loads in W");
        one(|_| {}, [200e3, 1000e3], "off the capacitor");
    }

    #[test]
    fn light_loads_and_lossy_parts_are_taken_as_they_are() {
        // 2.5 A of ripple at 0.2 A, a resistive electrolytic, a resistive path
        assert_eq!(said(|_| {}, [5.0, 20.0]), Vec::<String>::new());
        assert_eq!(said(|p| p.capacitor.esr = 1.0, [200.0, 1000.0]), Vec::<String>::new());
        assert_eq!(said(|p| p.inductor.dcr = 2.0, [200.0, 1000.0]), Vec::<String>::new());
    }
}
